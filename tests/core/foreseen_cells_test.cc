// Cells computed ahead are those that would be computed when they are asked for, to the bit.
#include "core/refine/foreseen_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
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
  for (const std::string_view kind : kKinds) {
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
    foreseen.Compute(
        vertices, kClip,
        [&](size_t i, Polytope<D>& cell) {
          cell.PlaceUnlessKeeps(kRatio);
          return Assessment{.bad_node = i % 2 == 0 ? -1 : static_cast<int>(i), .radius_sq = cell.reach_sq()};
        },
        context);
    EXPECT_FALSE(foreseen.Has(2 * kClip));
    Workspace<D> workspace;
    int unchanged = 0;
    int good = 0;
    int plain = 0;
    for (size_t i = 0; i < vertices.size(); ++i) {
      ASSERT_TRUE(foreseen.Has(kClip));
      const auto expected = CellNow<D>(structure, vertices[i], workspace);
      EXPECT_EQ(foreseen.Take(VertexId{structure.vertex_count() - 1}, kClip).cell, nullptr) << "not foreseen";
      const Look<D> look = foreseen.Take(vertices[i], kClip);
      Polytope<D>* const cell = look.cell;
      ASSERT_NE(cell, nullptr);
      std::vector<VertexId> neighbours;
      if (look.found != nullptr) {
        ++unchanged;
        EXPECT_EQ(look.found->bad_node, i % 2 == 0 ? -1 : static_cast<int>(i));
        EXPECT_EQ(look.found->radius_sq, cell->reach_sq());
        if (look.found->IsGood()) {
          ++good;
          cell->Neighbours(neighbours);
        }
      }
      EXPECT_TRUE(std::equal(look.neighbours.begin(), look.neighbours.end(), neighbours.begin(), neighbours.end()));
      plain += cell->KeepsRatio(kRatio) ? 1 : 0;
      cell->Place();
      ASSERT_EQ(Description<D>(*cell), expected);
      structure.AddVertex(vertices[i], points[i]);
    }
    EXPECT_FALSE(foreseen.Has(kClip)) << "none is left";
    EXPECT_GE(unchanged, 1);
    EXPECT_GE(good, 1);
    EXPECT_LT(unchanged, static_cast<int>(vertices.size())) << "some cells have changed";
    all_plain += plain;
  }
  EXPECT_EQ(all_plain > 0, D < 4) << "so few vertices leave no cell in 4-D that is not clipped";
}

TYPED_TEST(ForeseenCellsTest, WhatIsCancelledIsLeftOut) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = StructureOf<D>("uniform");
  ThreadTeam team(2);
  ForeseenCells<D> foreseen(structure, team);
  RunContext context;
  const std::vector<VertexId> vertices = {VertexId{0}, VertexId{1}, VertexId{2}};
  const auto judge = [&](size_t, Polytope<D>& cell) {
    context.Cancel();
    return Assessment{.radius_sq = cell.reach_sq()};
  };
  foreseen.Compute(vertices, kClip, judge, context);
  foreseen.Compute(vertices, kClip, judge, context);
  for (const VertexId v : vertices) {
    EXPECT_EQ(foreseen.Take(v, kClip).cell, nullptr);
  }
}

}  // namespace
}  // namespace wellspace::core
