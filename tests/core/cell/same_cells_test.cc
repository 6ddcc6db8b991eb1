// Cells are the same to the bit in whatever order their vertices come.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/voronoi/query_structure.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::MakeStructure;

constexpr double kClip = 0.4;
// Without ties, and with many.
constexpr std::string_view kKinds[] = {"uniform", "grid", "cospherical", "boundary", "rounded"};

// All that counts of a node: its position, to the bit, and its planes; in an order of its own.
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

template <int D>
auto CellNow(const QueryStructure<D>& structure, VertexId v, Workspace<D>& workspace) {
  structure.ClippedVoronoi(v, kClip, workspace, TieRule::kPerturb);
  return Description<D>(workspace.cell);
}

template <typename T>
class SameCellsTest : public test::SeededTest {
 protected:
  SameCellsTest() : SeededTest(1970) {}
};
TYPED_TEST_SUITE(SameCellsTest, test::UpTo4);

template <int D>
QueryStructure<D> StructureOf(std::string_view kind) {
  return MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 40, 12})));
}

TYPED_TEST(SameCellsTest, DoNotDependOnTheOrderOfTheCuts) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : kKinds) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = StructureOf<D>(kind);
    Workspace<D> workspace;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      const auto expected = CellNow<D>(structure, VertexId{v}, workspace);
      std::array<PlaneKind, 2 * D> kinds;
      const Point<D>& site = structure.point(VertexId{v});
      const Box<D> bounds = ClippedBox<D>(structure.box(), CubeAround<D>(site, kClip), kinds);
      for (int repeat = 0; repeat < 3; ++repeat) {
        Polytope<D> cell;
        test::CutByAll<D>(structure, VertexId{v}, bounds, kinds, TieRule::kPerturb, this->random_.Next(), cell);
        ASSERT_EQ(Description<D>(cell), expected) << "vertex " << v;
      }
    }
  }
}

TYPED_TEST(SameCellsTest, ScansAreTheSameByEveryVectorUnit) {
  constexpr int D = TypeParam::kValue;
  if (!Has(VectorUnit::kAvx2)) {
    GTEST_SKIP() << "this processor has one vector unit";
  }
  for (const std::string_view kind : kKinds) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, 500));
    Workspace<D> fast;
    Workspace<D> plain;
    plain.unit = VectorUnit::kBaseline;
    ASSERT_EQ(fast.unit, VectorUnit::kAvx2);
    for (uint32_t v = 0; v < structure.vertex_count(); v += 7) {
      ASSERT_EQ(CellNow<D>(structure, VertexId{v}, fast), CellNow<D>(structure, VertexId{v}, plain)) << "vertex " << v;
      const Neighbor nearest = structure.NearestNeighbor(VertexId{v}, fast);
      ASSERT_EQ(nearest.distance_sq, structure.NearestNeighbor(VertexId{v}, plain).distance_sq);
      ASSERT_EQ(fast.counters.leaves, plain.counters.leaves);
    }
    EXPECT_GT(fast.counters.leaves, fast.counters.queries);
    structure.tree().ForEachLeaf([&](NodeId leaf) {
      const auto* inside = structure.tree().VerticesIn(leaf);
      if (inside == nullptr) {
        return;
      }
      std::vector<double> by_fast(inside->count);
      std::vector<double> by_plain(inside->count);
      structure.NearestOfEach(leaf, fast, by_fast);
      structure.NearestOfEach(leaf, plain, by_plain);
      ASSERT_EQ(by_fast, by_plain);
      for (uint32_t i = 0; i < inside->count; ++i) {
        ASSERT_EQ(by_fast[i], structure.NearestNeighbor(inside->ids[i], fast).distance_sq);
      }
    });
  }
}

TYPED_TEST(SameCellsTest, UncommittedVerticesCountOnceTheyCutOrAreCommitted) {
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
      near = structure.AddUncommitted(near, points.back());  // near to an uncommitted one, from the second on
      ASSERT_EQ(near, VertexId{before + i});
      ASSERT_EQ(structure.point(near), points.back());
    }
    ASSERT_EQ(structure.vertex_count(), before + points.size());
    ASSERT_EQ(structure.uncommitted_count(), points.size());
    EXPECT_EQ(CellNow<D>(structure, VertexId{0}, workspace), of_others) << "queries do not find them";
    std::vector<decltype(Description<D>(workspace.cell))> cells;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      structure.UnplacedClippedVoronoi(VertexId{v}, CubeAround<D>(structure.point(VertexId{v}), kClip), workspace);
      structure.CutByUncommitted(VertexId{v}, workspace.cell);
      workspace.cell.Place();
      cells.push_back(Description<D>(workspace.cell));
    }
    structure.CommitAll();
    EXPECT_EQ(structure.uncommitted_count(), 0u);
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      ASSERT_EQ(CellNow<D>(structure, VertexId{v}, workspace), cells[v]) << "vertex " << v;
    }
    EXPECT_NE(cells[0], of_others);
  }
}

// All vertices, those of a leaf one after the other.
template <int D>
std::vector<VertexId> LeafByLeaf(const QueryStructure<D>& structure) {
  std::vector<VertexId> vertices;
  structure.tree().ForEachLeaf([&](NodeId leaf) {
    if (const auto* inside = structure.tree().VerticesIn(leaf); inside != nullptr) {
      vertices.insert(vertices.end(), inside->ids, inside->ids + inside->count);
    }
  });
  return vertices;
}

TYPED_TEST(SameCellsTest, ThoseOfManySitesAreThoseOfEach) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"uniform", "clusters", "lines", "grid", "cospherical", "boundary", "rounded"}) {
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({900, 900, 40})));
    for (int i = 0; i < 50; ++i) {  // some leaves are split
      Point<D> p;
      for (double& x : p) {
        x = 0.4 + 0.1 * this->random_.Unit();
      }
      structure.AddVertex(kNoVertex, p);
    }
    std::vector<VertexId> sites = LeafByLeaf<D>(structure);
    ASSERT_EQ(sites.size(), structure.vertex_count());
    sites.push_back(sites.front());  // again, and apart from its neighbours
    for (const double beta : {1.5, 4.0, std::numeric_limits<double>::infinity()}) {
      SCOPED_TRACE(beta);
      for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
        const VectorUnit unit = rule == TieRule::kKeep ? BestVectorUnit() : VectorUnit::kBaseline;
        Workspace<D> alone;
        Workspace<D> together;
        together.unit = unit;
        if constexpr (D <= 3) {
          together.cell = Polytope<D>(unit);
        }
        size_t taken = 0;
        const auto take = [&](VertexId v, double radius) {
          EXPECT_EQ(v, sites[taken++]);
          EXPECT_EQ(radius, beta * std::sqrt(structure.NearestNeighbor(v, alone).distance_sq));
          structure.ClippedVoronoi(v, radius, alone, rule);
          EXPECT_EQ(Description<D>(together.cell), Description<D>(alone.cell)) << "vertex " << Index(v);
          return !this->HasFailure();
        };
        structure.ClippedVoronoiOfEach(sites, beta, together, take, rule);
        ASSERT_EQ(taken, sites.size());
        if (D <= 3 && kind == "uniform" && beta < 5) {
          EXPECT_LT(2 * together.counters.leaves, alone.counters.leaves);
        }
      }
    }
  }
}

TYPED_TEST(SameCellsTest, ManySitesAreLeftOnceTheyAreNotTaken) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", 100));
  const std::vector<VertexId> sites = LeafByLeaf<D>(structure);
  Workspace<D> workspace;
  size_t taken = 0;
  structure.ClippedVoronoiOfEach(sites, 2, workspace, [&](VertexId, double) { return ++taken < 17; });
  EXPECT_EQ(taken, 17u);
  structure.ClippedVoronoiOfEach({}, 2, workspace, [&](VertexId, double) { return ++taken != 0; });
  EXPECT_EQ(taken, 17u);
}

}  // namespace
}  // namespace wellspace::core
