// Cells computed ahead are those that would be computed when they are asked for, to the bit.
#include "core/refine/foreseen_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/base/thread_team.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::MakeStructure;

constexpr double kClip = 0.4;
// Cells that keep it are handed out before their nodes are placed.
constexpr double kRatio = 3;
// Without ties, and with many.
constexpr std::string_view kKinds[] = {"uniform", "grid", "cospherical", "boundary", "rounded"};

// All that counts of a node: where it is, to the bit, and what its planes are; in an order of its own.
template <int D>
auto Description(const Polytope<D>& cell) {
  using Generators = std::vector<std::tuple<VertexId, PlaneKind, uint8_t>>;
  std::vector<std::tuple<Point<D>, double, Generators>> nodes;
  for (const CellNode<D>& node : cell.nodes()) {
    Generators generators;
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = cell.plane(index);
      generators.emplace_back(plane.vertex, plane.kind, plane.face);
    }
    nodes.emplace_back(node.x, node.slack, generators);
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

// What ForeseenCells promises a cell to be.
template <int D>
auto CellNow(const QueryStructure<D>& structure, VertexId v, Workspace<D>& workspace) {
  structure.ClippedVoronoi(v, kClip, workspace, TieRule::kPerturb);
  return Description<D>(workspace.cell);
}

template <typename T>
class ForeseenCellsTest : public test::SeededTest {
 protected:
  ForeseenCellsTest() : SeededTest(1970) {}
};
TYPED_TEST_SUITE(ForeseenCellsTest, test::UpTo4);

template <int D>
QueryStructure<D> StructureOf(std::string_view kind) {
  return MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 40, 12})));
}

TYPED_TEST(ForeseenCellsTest, CellsDoNotDependOnTheOrderOfTheCuts) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : kKinds) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = StructureOf<D>(kind);
    Workspace<D> workspace;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      const auto expected = CellNow<D>(structure, VertexId{v}, workspace);
      std::array<PlaneKind, 2 * D> kinds;
      const Point<D>& site = structure.point(VertexId{v});
      const Box<D> bounds = ClippedBox<D>(structure.box(), site, kClip, kinds);
      for (int repeat = 0; repeat < 3; ++repeat) {
        Polytope<D> cell;
        test::CutByAll<D>(structure, VertexId{v}, bounds, kinds, TieRule::kPerturb, this->random_.Next(), cell);
        ASSERT_EQ(Description<D>(cell), expected) << "vertex " << v;
      }
    }
  }
}

TYPED_TEST(ForeseenCellsTest, StayTrueWhileVerticesAreAdded) {
  constexpr int D = TypeParam::kValue;
  int all_plain = 0;
  for (size_t run = 0; run < 2 * std::size(kKinds); ++run) {
    const std::string_view kind = kKinds[run / 2];
    const bool adds_one_meanwhile = run % 2 != 0;
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = StructureOf<D>(kind);
    ThreadTeam team(2);
    ForeseenCells<D> foreseen(structure, team);
    std::vector<VertexId> vertices;
    for (uint32_t v = 0; v < ForeseenCells<D>::kMost && v < structure.vertex_count(); v += 2) {
      vertices.push_back(VertexId{v});
    }
    std::vector<Point<D>> points;  // one beside each, to be added
    for (const VertexId v : vertices) {
      Point<D> p = structure.point(v);
      for (int i = 0; i < D; ++i) {
        p[i] += 0.01 * (0.5 + this->random_.Unit()) * (p[i] < 0.5 ? 1 : -1);
      }
      points.push_back(p);
    }
    RunContext context;
    const auto is_odd = [](VertexId v) { return Index(v) / 2 % 2 != 0; };
    foreseen.Begin(
        vertices, kClip,
        [&](VertexId v, Polytope<D>& cell) {
          cell.PlaceUnlessKeeps(kRatio);
          return Assessment{.bad_node = is_odd(v) ? static_cast<int>(Index(v)) : -1, .radius_sq = cell.reach_sq()};
        },
        context);
    EXPECT_TRUE(foreseen.IsRunning());
    EXPECT_TRUE(foreseen.Comes(vertices.back(), kClip));
    EXPECT_FALSE(foreseen.Comes(vertices.back(), 2 * kClip));
    EXPECT_FALSE(foreseen.Comes(VertexId{1}, kClip));
    if (adds_one_meanwhile) {
      structure.AddWaiting(vertices.back(), points.back());
    }
    EXPECT_EQ(foreseen.Take(vertices[0], kClip).cell, nullptr) << "it comes";
    foreseen.Finish();
    EXPECT_FALSE(foreseen.IsRunning());
    structure.AdmitWaiting();
    foreseen.Advance();
    EXPECT_FALSE(foreseen.Comes(vertices[0], kClip));
    EXPECT_FALSE(foreseen.SomeCome(kClip));
    Workspace<D> workspace;
    int unchanged = 0;
    int good = 0;
    int plain = 0;
    for (size_t i = 0; i < vertices.size(); ++i) {
      ASSERT_TRUE(foreseen.IsReady(vertices[i], kClip));
      const auto expected = CellNow<D>(structure, vertices[i], workspace);
      EXPECT_EQ(foreseen.Take(VertexId{structure.vertex_count() - 1}, kClip).cell, nullptr) << "not foreseen";
      const Look<D> look = foreseen.Take(vertices[i], kClip);
      Polytope<D>* const cell = look.cell;
      ASSERT_NE(cell, nullptr);
      ASSERT_EQ(look.star != nullptr, look.found != nullptr && look.found->IsGood());
      if (look.found != nullptr) {
        ++unchanged;
        EXPECT_EQ(look.found->bad_node, is_odd(vertices[i]) ? static_cast<int>(Index(vertices[i])) : -1);
        EXPECT_EQ(look.found->radius_sq, cell->reach_sq());
      }
      if (look.star != nullptr) {
        ++good;
        Star<D> star;
        cell->FindStar(star);
        EXPECT_EQ(*look.star, star);
      }
      plain += cell->KeepsRatio(kRatio) ? 1 : 0;
      cell->Place();
      ASSERT_EQ(Description<D>(*cell), expected);
      if (!adds_one_meanwhile || i + 1 < vertices.size()) {
        structure.AddVertex(vertices[i], points[i]);
      }
    }
    EXPECT_FALSE(foreseen.IsReady(vertices.back(), kClip)) << "none is left";
    EXPECT_TRUE(adds_one_meanwhile || unchanged >= 1);
    EXPECT_TRUE(adds_one_meanwhile || good >= 1);
    EXPECT_LT(unchanged, static_cast<int>(vertices.size())) << "some cells have changed";
    all_plain += plain;
  }
  EXPECT_EQ(all_plain > 0, D < 4) << "so few vertices leave no cell in 4-D that is not clipped";
}

TYPED_TEST(ForeseenCellsTest, VerticesThatWaitCountOnceTheyCutOrAreAdmitted) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : kKinds) {
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = StructureOf<D>(kind);
    const uint32_t before = structure.vertex_count();
    Workspace<D> workspace;
    const auto of_others = CellNow<D>(structure, VertexId{0}, workspace);
    std::vector<Point<D>> points;
    VertexId near{0};
    for (int i = 0; i < 5; ++i) {
      points.push_back(structure.point(near));
      for (double& x : points.back()) {
        x += 0.01 * (0.5 + this->random_.Unit()) * (x < 0.5 ? 1 : -1);
      }
      near = structure.AddWaiting(near, points.back());  // near to one that waits, from the second on
      ASSERT_EQ(near, VertexId{before + i});
      ASSERT_EQ(structure.point(near), points.back());
    }
    ASSERT_EQ(structure.vertex_count(), before + points.size());
    ASSERT_EQ(structure.waiting_count(), points.size());
    EXPECT_EQ(CellNow<D>(structure, VertexId{0}, workspace), of_others) << "queries do not find them";
    std::vector<decltype(Description<D>(workspace.cell))> cells;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      structure.UnplacedClippedVoronoi(VertexId{v}, kClip, workspace);
      structure.CutByWaiting(VertexId{v}, workspace.cell);
      workspace.cell.Place();
      cells.push_back(Description<D>(workspace.cell));
    }
    structure.AdmitWaiting();
    EXPECT_EQ(structure.waiting_count(), 0u);
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      ASSERT_EQ(CellNow<D>(structure, VertexId{v}, workspace), cells[v]) << "vertex " << v;
    }
    EXPECT_NE(cells[0], of_others);
  }
}

// Three vertices whose cells are to be foreseen.
template <int D>
struct Few {
  const QueryStructure<D> structure = StructureOf<D>("uniform");
  ThreadTeam team = ThreadTeam(2);
  ForeseenCells<D> foreseen = ForeseenCells<D>(structure, team);
  RunContext context;
  const std::vector<VertexId> vertices = {VertexId{0}, VertexId{1}, VertexId{2}};
};

TYPED_TEST(ForeseenCellsTest, WhatIsCancelledIsLeftOut) {
  constexpr int D = TypeParam::kValue;
  Few<D> few;
  auto& [structure, team, foreseen, context, vertices] = few;
  const auto judge = [&](VertexId, Polytope<D>& cell) {
    context.Cancel();
    return Assessment{.radius_sq = cell.reach_sq()};
  };
  for (int batch = 0; batch < 2; ++batch) {
    foreseen.Begin(vertices, kClip, judge, context);
    foreseen.Finish();
    foreseen.Advance();
  }
  for (const VertexId v : vertices) {
    EXPECT_EQ(foreseen.Take(v, kClip).cell, nullptr);
  }
}

TYPED_TEST(ForeseenCellsTest, WhatIsDroppedDoesNotCome) {
  constexpr int D = TypeParam::kValue;
  Few<D> few;
  auto& [structure, team, foreseen, context, vertices] = few;
  const auto judge = [](VertexId, Polytope<D>& cell) { return Assessment{.radius_sq = cell.reach_sq()}; };
  foreseen.Drop();  // nothing
  foreseen.Begin(vertices, kClip, judge, context);
  foreseen.Drop();
  EXPECT_FALSE(foreseen.IsRunning());
  EXPECT_FALSE(foreseen.SomeCome(kClip));
  foreseen.Begin(vertices, kClip, judge, context);
  foreseen.Finish();
  EXPECT_TRUE(foreseen.SomeCome(kClip));
  foreseen.Advance();
  EXPECT_FALSE(foreseen.SomeCome(kClip));
  for (const VertexId v : vertices) {
    EXPECT_TRUE(foreseen.IsReady(v, kClip));
    EXPECT_FALSE(foreseen.IsReady(v, 2 * kClip));
    EXPECT_NE(foreseen.Take(v, kClip).cell, nullptr);
  }
}

}  // namespace
}  // namespace wellspace::core
