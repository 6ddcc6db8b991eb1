// Cells are the same to the bit in whatever order their vertices come.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
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
      const Neighbor nearest = structure.ApproximateNearestNeighbor(VertexId{v}, fast);
      ASSERT_EQ(nearest.distance_sq, structure.ApproximateNearestNeighbor(VertexId{v}, plain).distance_sq);
      ASSERT_EQ(fast.counters.leaves, plain.counters.leaves);
    }
    EXPECT_GT(fast.counters.leaves, fast.counters.queries);
    structure.tree().ForEachLeaf([&](NodeId leaf) {
      const auto* bucket = structure.tree().BucketOf(leaf);
      if (bucket == nullptr) {
        return;
      }
      std::vector<double> by_fast(bucket->count);
      std::vector<double> by_plain(bucket->count);
      structure.NearestOfEach(leaf, fast, by_fast);
      structure.NearestOfEach(leaf, plain, by_plain);
      ASSERT_EQ(by_fast, by_plain);
      for (uint32_t i = 0; i < bucket->count; ++i) {
        ASSERT_EQ(by_fast[i], structure.ApproximateNearestNeighbor(bucket->ids[i], fast).distance_sq);
      }
    });
  }
}

TYPED_TEST(SameCellsTest, VerticesThatWaitCountOnceTheyCutOrAreAdmitted) {
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
      structure.UnplacedClippedVoronoi(VertexId{v}, CubeAround<D>(structure.point(VertexId{v}), kClip), workspace);
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

}  // namespace
}  // namespace wellspace::core
