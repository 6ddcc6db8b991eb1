// Where queries about the surface begin: nodes of the index that are handed down with leaves of the vertices' tree.
#include "core/tree/surface_nodes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/tree/leaf_tree.h"
#include "core/tree/surface_index.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

class SurfaceNodesTest : public test::SeededTest {
 protected:
  SurfaceNodesTest() : SeededTest(88'021) {}
};

// The smallest node of the index that a cube of the grid lies in, from the root.
IndexNode NodeHolding(const SurfaceIndex& index, const MortonGrid<3>& grid, const Point<3>& low, int level) {
  IndexNode node = 0;
  Point<3> at = grid.root_low();
  for (int l = 0; l < level && !index.IsLeaf(node); ++l) {
    const double half = std::ldexp(grid.root_side(), -l - 1);
    uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (low[axis] >= at[axis] + half) {
        at[axis] += half;
        child |= 1u << axis;
      }
    }
    node = index.Child(node, child);
  }
  return node;
}

TEST_F(SurfaceNodesTest, LeavesKnowTheSmallestNodesThatHoldThem) {
  const RunContext context;
  const test::TestSurface surface = test::Sphere(3, {0.5, 0.5, 0.5}, 0.3);
  const SurfaceComplex complex = *MakeSurfaceComplex(surface.points, {}, surface.Features(), context);
  const Solids solids = *FindSolids(complex, context);
  const MortonGrid<3> grid(Box<3>{{0, 0, 0}, {1, 1, 1}}, 1000);
  SurfaceIndex index;
  ASSERT_TRUE(index.Build(complex, solids, grid, context).ok());

  std::vector<Point<3>> points;
  for (int i = 0; i < 1000; ++i) {
    points.push_back({random_.Unit(), random_.Unit(), random_.Unit()});
  }
  std::sort(points.begin(), points.end(),
            [&](const Point<3>& p, const Point<3>& q) { return MortonLess<3>(grid.CubeOf(p), grid.CubeOf(q)); });
  LeafTree<3> tree;
  ASSERT_TRUE(tree.Build(grid, points, 1'000'000, 1, context).ok());
  tree.FollowSurface(index);

  uint64_t smaller = 0;  // leaves than the nodes that hold them
  uint64_t as_large = 0;
  const auto check = [&] {
    tree.ForEachLeaf([&](NodeId leaf) {
      const IndexNode node = tree.surface_nodes().Of(leaf);
      ASSERT_EQ(node, NodeHolding(index, grid, tree.LowOf(leaf), tree.level(leaf)));
      ASSERT_LE(index.level(node), tree.level(leaf));
      (index.level(node) < tree.level(leaf) ? smaller : as_large) += 1;
    });
  };
  check();
  // Vertices in a corner of the sphere and in the middle of nothing: leaves are split, also for balance.
  const uint64_t before = tree.leaf_count();
  for (uint32_t v = 1000; v < 4000; ++v) {
    const double size = v % 2 == 0 ? 1e-3 : 0.05;
    const double from = v % 2 == 0 ? 0.32 : 0.9;
    const Point<3> p = {from + size * random_.Unit(), from + size * random_.Unit(), from + size * random_.Unit()};
    tree.Insert(kNoVertex, VertexId{v}, p);
    const NodeId leaf = tree.leaf_of(VertexId{v});
    ASSERT_EQ(index.SolidAt(p, tree.surface_nodes().Of(leaf)), index.SolidAt(p));
  }
  EXPECT_GT(tree.leaf_count(), before);
  check();
  EXPECT_GT(smaller, 0u);
  EXPECT_GT(as_large, 0u);
}

}  // namespace
}  // namespace wellspace::core
