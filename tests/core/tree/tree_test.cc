// The tree against its definition, by a look at all pairs of leaves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "core/tree/leaf_tree.h"
#include "core/tree/morton.h"
#include "tests/core/tree/tree_boxes.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::MortonSorted;
using test::SplitMix64;
using ::testing::HasSubstr;

constexpr uint64_t kManyLeaves = 1'000'000;

template <int D>
LeafTree<D> BuildTree(const MortonGrid<D>& grid, const std::vector<Point<D>>& points) {
  RunContext context;
  LeafTree<D> tree;
  const absl::Status built = tree.Build(grid, points, kManyLeaves, 1, context);
  EXPECT_TRUE(built.ok()) << built;
  return tree;
}

template <int D>
MortonGrid<D> UnitGrid() {
  return MortonGrid<D>(test::UnitBox<D>());
}

template <int D>
std::string Description(const MortonGrid<D>& grid) {
  return ::testing::PrintToString(grid.box().low) + ::testing::PrintToString(grid.box().high) + " in a root of side " +
         ::testing::PrintToString(grid.root_side());
}

template <int D>
std::vector<NodeId> LeavesOf(const LeafTree<D>& tree) {
  std::vector<NodeId> leaves;
  tree.ForEachLeaf([&](NodeId leaf) { leaves.push_back(leaf); });
  return leaves;
}

template <int D>
double SideOf(const Box<D>& cube) {
  return cube.high[0] - cube.low[0];
}

// The part of a cube in the box; empty where low >= high on some axis.
template <int D>
Box<D> Clipped(Box<D> cube, const Box<D>& box) {
  for (int k = 0; k < D; ++k) {
    cube.low[k] = std::max(cube.low[k], box.low[k]);
    cube.high[k] = std::min(cube.high[k], box.high[k]);
  }
  return cube;
}

template <int D>
bool HasInterior(const Box<D>& box) {
  for (int k = 0; k < D; ++k) {
    if (!(box.low[k] < box.high[k])) {
      return false;
    }
  }
  return true;
}

// On how many axes two boxes overlap, and on how many they merely touch.
struct Contact {
  int overlaps = 0;
  int touches = 0;
};

template <int D>
Contact ContactOf(const Box<D>& a, const Box<D>& b) {
  Contact contact;
  for (int k = 0; k < D; ++k) {
    const double low = std::max(a.low[k], b.low[k]);
    const double high = std::min(a.high[k], b.high[k]);
    contact.overlaps += low < high ? 1 : 0;
    contact.touches += low == high ? 1 : 0;
  }
  return contact;
}

// The leaves are cubes of the grid; they cover the box and do not overlap; invariants (2) and (5).
template <int D>
void ExpectBalancedPartition(const LeafTree<D>& tree, const MortonGrid<D>& grid) {
  const Box<D>& box = grid.box();
  const std::vector<NodeId> leaves = LeavesOf<D>(tree);
  ASSERT_EQ(leaves.size(), tree.leaf_count());
  ASSERT_EQ(leaves.size(), static_cast<size_t>(std::count_if(leaves.begin(), leaves.end(),
                                                             [&](NodeId leaf) { return tree.IsLeaf(leaf); })));
  std::vector<Box<D>> cubes;
  ExactVolumeSum<D> uncovered;
  Box<D> negative = box;
  std::swap(negative.low[0], negative.high[0]);
  uncovered.Subtract(negative);
  for (const NodeId leaf : leaves) {
    const Box<D> cube = tree.BoxOf(leaf);
    cubes.push_back(cube);
    for (int k = 0; k < D; ++k) {
      ASSERT_EQ(cube.high[k] - cube.low[k], std::ldexp(grid.root_side(), -tree.level(leaf)));
      ASSERT_EQ(std::remainder(cube.low[k] - grid.root_low()[k], SideOf<D>(cube)), 0);
    }
    ASSERT_TRUE(HasInterior<D>(Clipped<D>(cube, box))) << "a leaf outside the box";
    uncovered.Subtract(Clipped<D>(cube, box));
  }
  EXPECT_EQ(uncovered.sign(), Sign::kZero) << uncovered.value() << " of the box is not covered, or covered twice";

  for (size_t i = 0; i < leaves.size(); ++i) {
    std::set<uint32_t> expected;
    for (size_t j = 0; j < leaves.size(); ++j) {
      const Contact contact = ContactOf<D>(cubes[i], cubes[j]);
      if (i == j || contact.overlaps + contact.touches < D) {
        continue;
      }
      ASSERT_GT(contact.touches, 0) << "leaves " << Index(leaves[i]) << " and " << Index(leaves[j]) << " overlap";
      ASSERT_LE(std::abs(tree.level(leaves[i]) - tree.level(leaves[j])), 1) << "unbalanced";
      if (contact.touches == 1) {
        expected.insert(Index(leaves[j]));
      }
    }
    std::set<uint32_t> found;
    tree.ForEachFaceNeighbour(
        leaves[i], [&](NodeId beyond) { ASSERT_TRUE(found.insert(Index(beyond)).second) << "a neighbour twice"; });
    ASSERT_EQ(found, expected) << "of leaf " << Index(leaves[i]);
  }
}

template <int D>
Point<D> CentreOf(const Box<D>& cube) {
  Point<D> centre;
  for (int k = 0; k < D; ++k) {
    centre[k] = 0.5 * (cube.low[k] + cube.high[k]);
  }
  return centre;
}

// Whether a cube meets the straight line between two points, or comes as near as rounding.
template <int D>
bool IsOnLine(const Box<D>& cube, const Point<D>& from, const Point<D>& to) {
  double first = 0;
  double last = 1;
  for (int k = 0; k < D; ++k) {
    const double margin = 1e-9 * SideOf<D>(cube);
    const double low = cube.low[k] - margin - from[k];
    const double high = cube.high[k] + margin - from[k];
    const double along = to[k] - from[k];
    if (along == 0) {
      if (low > 0 || high < 0) {
        return false;
      }
      continue;
    }
    first = std::max(first, std::min(low / along, high / along));
    last = std::min(last, std::max(low / along, high / along));
  }
  return first <= last;
}

// A walk from leaf to leaf, through facets that a straight line from a point leaves by, comes to every leaf by leaves
// on the line to it.
template <int D>
void ExpectWalksAway(const LeafTree<D>& tree, const Box<D>& box) {
  const std::vector<NodeId> leaves = LeavesOf<D>(tree);
  for (size_t i = 0; i < leaves.size(); ++i) {
    const NodeId target = leaves[(7 * i + 3) % leaves.size()];
    const Point<D> from = CentreOf<D>(Clipped<D>(tree.BoxOf(leaves[i]), box));
    const Point<D> to = CentreOf<D>(Clipped<D>(tree.BoxOf(target), box));
    std::vector<NodeId> reached = {leaves[i]};
    std::set<uint32_t> seen = {Index(leaves[i])};
    for (size_t at = 0; at < reached.size(); ++at) {
      const Box<D> cube = tree.BoxOf(reached[at]);
      uint32_t facets = 0;
      for (int k = 0; k < D; ++k) {
        facets |= (from[k] >= cube.low[k] ? 1u : 0u) << FaceIndex(k, false);
        facets |= (from[k] <= cube.high[k] ? 1u : 0u) << FaceIndex(k, true);
      }
      tree.ForEachBeyondFacets(reached[at], facets, [&](NodeId beyond) {
        const Box<D> next = tree.BoxOf(beyond);
        for (int k = 0; k < D; ++k) {
          ASSERT_FALSE(next.high[k] == cube.low[k] && from[k] < cube.low[k]) << "back along axis " << k;
          ASSERT_FALSE(next.low[k] == cube.high[k] && from[k] > cube.high[k]) << "back along axis " << k;
        }
        if (IsOnLine<D>(next, from, to) && seen.insert(Index(beyond)).second) {
          reached.push_back(beyond);
        }
      });
    }
    ASSERT_TRUE(seen.contains(Index(target))) << "from leaf " << Index(leaves[i]) << " to leaf " << Index(target);
  }
}

// Invariants (1) and (4); every vertex is where leaf_of says, and nowhere else.
template <int D>
void ExpectVerticesInPlace(const LeafTree<D>& tree, const std::vector<Point<D>>& points) {
  ASSERT_EQ(tree.vertex_count(), points.size());
  size_t held = 0;
  for (const NodeId leaf : LeavesOf<D>(tree)) {
    const auto* inside = tree.VerticesIn(leaf);
    if (inside == nullptr) {
      continue;
    }
    ASSERT_LE(inside->count, static_cast<uint32_t>(LeafTree<D>::kLeafCapacity));
    held += inside->count;
    for (uint32_t i = 0; i < inside->count; ++i) {
      ASSERT_LT(Index(inside->ids[i]), points.size());
      ASSERT_EQ(tree.leaf_of(inside->ids[i]), leaf);
      ASSERT_EQ(inside->positions[i], points[Index(inside->ids[i])]);
      ASSERT_TRUE(tree.BoxOf(leaf).Contains(inside->positions[i]));
    }
  }
  EXPECT_EQ(held, points.size());
}

// Invariant (3), lower bound: sampled at the corners of a leaf, inside, and where points are nearest to it.
template <int D>
void ExpectLeavesNoCoarserThanFeatures(const LeafTree<D>& tree, const MortonGrid<D>& grid,
                                       const std::vector<Point<D>>& points, SplitMix64& random) {
  const Box<D>& box = grid.box();
  for (const NodeId leaf : LeavesOf<D>(tree)) {
    const Box<D> cube = Clipped<D>(tree.BoxOf(leaf), box);
    const double least = SideOf<D>(tree.BoxOf(leaf)) / (2 * LeafTree<D>::kCoarseness);
    if (tree.level(leaf) == grid.levels()) {
      continue;
    }
    ASSERT_LE(SideOf<D>(tree.BoxOf(leaf)), box.ShortestSide());
    std::vector<Point<D>> samples;
    for (int i = 0; i < 8 + (1 << D); ++i) {
      Point<D> x;
      for (int k = 0; k < D; ++k) {
        const double t = i < (1 << D) ? (i >> k) & 1 : random.Unit();
        x[k] = std::clamp(cube.low[k] + t * (cube.high[k] - cube.low[k]), cube.low[k], cube.high[k]);
      }
      samples.push_back(x);
    }
    for (Point<D> p : points) {
      if (DistanceSq<D>(p, cube) <= least * least) {
        for (int k = 0; k < D; ++k) {
          p[k] = std::clamp(p[k], cube.low[k], cube.high[k]);
        }
        samples.push_back(p);
      }
    }
    for (const Point<D>& x : samples) {
      ASSERT_GE(test::LocalFeatureSize<D>(box, points, x), least * (1 - 1e-12))
          << "in leaf " << Index(leaf) << " at " << ::testing::PrintToString(x);
    }
  }
}

// The tree's bound on the points' separation is true, and is above 0 unless a leaf is as small as the grid's
// cubes.
template <int D>
void ExpectSeparated(const LeafTree<D>& tree, const MortonGrid<D>& grid, const std::vector<Point<D>>& points) {
  for (uint32_t v = 0; v < points.size(); ++v) {
    const NodeId leaf = tree.leaf_of(VertexId{v});
    const double separation = tree.SeparationIn(leaf);
    ASSERT_EQ(separation > 0, tree.level(leaf) < grid.levels());
    ASSERT_GE(test::LocalFeatureSize<D>(grid.box(), points, points[v]), separation) << "of vertex " << v;
  }
}

// Whether two features are near enough to the cube and each other for it to be too coarse.
template <int D>
bool AreFeaturesNear(const Box<D>& cube, const Box<D>& box, const std::vector<Point<D>>& points) {
  const double reach = SideOf<D>(cube) / LeafTree<D>::kCoarseness * (1 + 1e-12);
  for (size_t i = 0; i < points.size(); ++i) {
    if (DistanceSq<D>(points[i], cube) > reach * reach) {
      continue;
    }
    for (int face = 0; face < 2 * D; ++face) {
      if (((box.FacesOf(points[i]) >> face) & 1) == 0 && box.DistanceToFace(points[i], face) <= 2 * reach) {
        return true;
      }
    }
    for (size_t j = 0; j < i; ++j) {
      if (DistanceSq<D>(points[j], cube) <= reach * reach && DistanceSq<D>(points[i], points[j]) <= 4 * reach * reach) {
        return true;
      }
    }
  }
  return false;
}

// Invariant (3), upper bound: every inner node had a reason to be split.
template <int D>
void ExpectEverySplitHasAReason(const LeafTree<D>& tree, const Box<D>& box, const std::vector<Point<D>>& points) {
  std::vector<NodeId> inner;
  for (uint32_t i = 0; i < tree.node_count(); ++i) {
    if (!tree.IsLeaf(NodeId{i}) && HasInterior<D>(Clipped<D>(tree.BoxOf(NodeId{i}), box))) {
      inner.push_back(NodeId{i});
    }
  }
  for (const NodeId node : inner) {
    const Box<D> cube = tree.BoxOf(node);
    const auto held = std::count_if(points.begin(), points.end(), [&](const Point<D>& p) { return cube.Contains(p); });
    const auto is_smaller_beside = [&](NodeId other) {
      const Contact contact = ContactOf<D>(tree.BoxOf(other), cube);
      return tree.level(other) == tree.level(node) + 1 && contact.touches > 0 &&
             contact.overlaps + contact.touches == D;
    };
    ASSERT_TRUE(SideOf<D>(cube) > box.ShortestSide() || held > LeafTree<D>::kLeafCapacity ||
                AreFeaturesNear<D>(cube, box, points) || std::any_of(inner.begin(), inner.end(), is_smaller_beside))
        << "node " << Index(node) << " on level " << tree.level(node) << " was split for nothing";
  }
}

template <int D>
void ExpectInvariants(const LeafTree<D>& tree, const MortonGrid<D>& grid, const std::vector<Point<D>>& points) {
  ExpectBalancedPartition<D>(tree, grid);
  ExpectWalksAway<D>(tree, grid.box());
  ExpectVerticesInPlace<D>(tree, points);
}

template <int D>
void ExpectBuildInvariants(const MortonGrid<D>& grid, const std::vector<Point<D>>& points, SplitMix64& random) {
  const LeafTree<D> tree = BuildTree<D>(grid, points);
  ExpectInvariants<D>(tree, grid, points);
  ExpectLeavesNoCoarserThanFeatures<D>(tree, grid, points, random);
  ExpectSeparated<D>(tree, grid, points);
  ExpectEverySplitHasAReason<D>(tree, grid.box(), points);
}

// The points of the unit box, brought to `box`: those on faces lie on its faces exactly.
template <int D>
std::vector<Point<D>> Stretched(std::vector<Point<D>> points, const Box<D>& box) {
  for (Point<D>& p : points) {
    for (int k = 0; k < D; ++k) {
      p[k] = p[k] == 1 ? box.high[k] : std::min(box.low[k] + p[k] * (box.high[k] - box.low[k]), box.high[k]);
    }
  }
  return points;
}

template <typename T>
class TreeTest : public test::SeededTest {
 protected:
  TreeTest() : SeededTest(1990) {}
};
TYPED_TEST_SUITE(TreeTest, test::AllDimensions);

TYPED_TEST(TreeTest, EmptyCloudGivesLeavesNoLongerThanTheBox) {
  constexpr int D = TypeParam::kValue;
  for (const MortonGrid<D>& grid : Grids<D>()) {
    SCOPED_TRACE(Description<D>(grid));
    ExpectBuildInvariants<D>(grid, {}, this->random_);
  }
}

TYPED_TEST(TreeTest, BuildKeepsTheInvariantsOnEveryKindOfCloud) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : test::AllKinds()) {
    SCOPED_TRACE(std::string(kind));
    ExpectBuildInvariants<D>(UnitGrid<D>(), test::SortedCloud<D>(kind, ByDimension<D>({60, 14, 5, 2})), this->random_);
  }
}

TYPED_TEST(TreeTest, BuildKeepsTheInvariantsInEveryBox) {
  constexpr int D = TypeParam::kValue;
  for (const MortonGrid<D>& grid : Grids<D>()) {
    SCOPED_TRACE(Description<D>(grid));
    for (const std::string_view kind : {"boundary", "uniform"}) {
      const auto cloud = test::ToPoints<D>(test::MakeCloud(kind, D, ByDimension<D>({40, 10, 4, 2})));
      ExpectBuildInvariants<D>(grid, MortonSorted<D>(grid, Stretched<D>(cloud, grid.box())), this->random_);
    }
  }
}

TYPED_TEST(TreeTest, CrowdedLeavesAreSplit) {
  constexpr int D = TypeParam::kValue;
  ExpectBuildInvariants<D>(UnitGrid<D>(), test::SortedCloud<D>("grid", ByDimension<D>({400, 125, 256, 1024})),
                           this->random_);
}

// A leaf beside a crowded cube of its size, which is split before: what lies in the cube near the leaf, in whatever
// direction, counts. The leaf beyond, half as large, does not find the pair by itself.
TYPED_TEST(TreeTest, FeaturesInSmallerLeavesBesideCount) {
  constexpr int D = TypeParam::kValue;
  constexpr double kSide = 0.25;
  constexpr double kReach = kSide / LeafTree<D>::kCoarseness;
  const int per_axis = static_cast<int>(std::ceil(std::pow(LeafTree<D>::kLeafCapacity + 1, 1.0 / D)));
  const auto crowd = static_cast<int>(std::lround(std::pow(per_axis, D)));
  const auto directions = static_cast<int>(std::lround(std::pow(3, D)));
  for (int direction = 0; direction < directions; direction += D <= 4 ? 1 : 29) {
    std::array<int, D> toward;
    double length_sq = 0;
    for (int k = 0, rest = direction; k < D; ++k, rest /= 3) {
      toward[k] = rest % 3 - 1;
      length_sq += toward[k] * toward[k];
    }
    if (length_sq == 0) {
      continue;
    }
    std::vector<Point<D>> points;
    for (int i = 0; i < crowd; ++i) {
      Point<D> p;
      for (int k = 0, rest = i; k < D; ++k, rest /= per_axis) {
        p[k] = kSide * (1 + toward[k] + 0.25 + 0.5 * (rest % per_axis + 0.5) / per_axis);
      }
      points.push_back(p);
    }
    Point<D> within;  // the leaf [kSide, 2 kSide]^D
    Point<D> beyond;
    for (int k = 0; k < D; ++k) {
      const double contact = kSide * (toward[k] == 0 ? 1.4 : toward[k] < 0 ? 1 : 2);
      within[k] = contact - 0.8 * kReach * toward[k] / std::sqrt(length_sq);
      beyond[k] = contact + 0.02 * kReach * toward[k] / std::sqrt(length_sq);
    }
    points.push_back(within);
    const auto level_of = [](const std::vector<Point<D>>& cloud, const Point<D>& p) {
      const LeafTree<D> tree = BuildTree<D>(UnitGrid<D>(), MortonSorted<D>(test::UnitBox<D>(), cloud));
      return tree.level(tree.LeafHolding(kNoVertex, p));
    };
    ASSERT_EQ(level_of(points, within), 2) << "direction " << direction;
    points.push_back(beyond);
    ASSERT_GT(level_of(points, within), 2) << "direction " << direction;
  }
}

// Points where leaves meet: in the middle, on faces, edges and corners, the high ones too.
TYPED_TEST(TreeTest, PointsBetweenLeavesBelongToOne) {
  constexpr int D = TypeParam::kValue;
  std::vector<Point<D>> points;
  const int steps = ByDimension<D>({8, 2});
  const auto count = static_cast<int>(std::lround(std::pow(steps + 1, D)));
  for (int i = 0; i < count; ++i) {
    Point<D> p;
    for (int k = 0, rest = i; k < D; ++k, rest /= steps + 1) {
      p[k] = static_cast<double>(rest % (steps + 1)) / steps;
    }
    points.push_back(p);
  }
  ExpectBuildInvariants<D>(UnitGrid<D>(), MortonSorted<D>(test::UnitBox<D>(), points), this->random_);
}

// Points draw nearer to one place, so that leaf after leaf is split, and larger ones beside them for balance.
TYPED_TEST(TreeTest, InsertKeepsTheInvariants) {
  constexpr int D = TypeParam::kValue;
  uint64_t new_leaves = 0;
  for (const MortonGrid<D>& grid : Grids<D>()) {
    const Box<D>& box = grid.box();
    SCOPED_TRACE(Description<D>(grid));
    std::vector<Point<D>> points = MortonSorted<D>(
        grid, Stretched<D>(test::ToPoints<D>(test::MakeCloud("boundary", D, ByDimension<D>({30, 8, 4, 2}))), box));
    LeafTree<D> tree = BuildTree<D>(grid, points);
    std::set<GridPoint<D>> taken;
    for (const Point<D>& p : points) {
      taken.insert(grid.CubeOf(p));
    }
    const uint64_t leaves = tree.leaf_count();
    Point<D> center;
    for (double& x : center) {
      x = this->random_.Below(3) == 0 ? 1 : this->random_.Unit();
    }
    const size_t inserts = D <= 3 ? ByDimension<D>({200, 120}) : 2 * LeafTree<D>::kLeafCapacity;
    for (size_t i = 0; i < inserts; ++i) {
      const double radius = std::pow(10.0, -3.0 * static_cast<double>(i) / static_cast<double>(inserts));
      Point<D> p;
      for (int k = 0; k < D; ++k) {
        p[k] = std::clamp(center[k] + radius * (2 * this->random_.Unit() - 1), 0.0, 1.0);
      }
      p = Stretched<D>({p}, box)[0];
      if (!taken.insert(grid.CubeOf(p)).second) {
        continue;  // clamped to where one is already
      }
      const VertexId v{tree.vertex_count()};
      const VertexId near = Index(v) == 0 || i % 5 == 0 ? kNoVertex : VertexId(this->random_.Below(Index(v)));
      tree.Insert(near, v, p);
      points.push_back(p);
      ASSERT_EQ(tree.vertex_count(), points.size());
    }
    new_leaves += tree.leaf_count() - leaves;
    ExpectInvariants<D>(tree, grid, points);
  }
  EXPECT_GT(new_leaves, 20u);
}

// From wherever the walk starts, it ends in the same leaf.
TYPED_TEST(TreeTest, InsertFindsTheLeafFromAnywhere) {
  constexpr int D = TypeParam::kValue;
  const std::vector<Point<D>> points = test::SortedCloud<D>("boundary", 30);
  const VertexId v{static_cast<uint32_t>(points.size())};
  for (int i = 0; i < 40; ++i) {
    Point<D> p;
    for (double& x : p) {
      const uint64_t place = this->random_.Below(4);
      x = place == 0 ? 0 : place == 1 ? 1 : place == 2 ? 0.5 : this->random_.Unit();
    }
    LeafTree<D> from_root = BuildTree<D>(UnitGrid<D>(), points);
    from_root.Insert(kNoVertex, v, p);
    for (int start = 0; start < 5; ++start) {
      LeafTree<D> tree = BuildTree<D>(UnitGrid<D>(), points);
      tree.Insert(VertexId(this->random_.Below(points.size())), v, p);
      ASSERT_EQ(tree.leaf_of(v), from_root.leaf_of(v)) << ::testing::PrintToString(p);
    }
  }
}

TYPED_TEST(TreeTest, BuildAnewForgetsTheOldTree) {
  constexpr int D = TypeParam::kValue;
  LeafTree<D> tree = BuildTree<D>(UnitGrid<D>(), test::SortedCloud<D>("uniform", 50));
  const std::vector<Point<D>> points = test::SortedCloud<D>("boundary", 20);
  RunContext context;
  ASSERT_TRUE(tree.Build(UnitGrid<D>(), points, kManyLeaves, 1, context).ok());
  ExpectInvariants<D>(tree, UnitGrid<D>(), points);
}

TYPED_TEST(TreeTest, BuildEndsAtItsBudget) {
  constexpr int D = TypeParam::kValue;
  const std::vector<Point<D>> points = test::SortedCloud<D>("uniform", 100);
  RunContext context;
  const uint64_t needed = BuildTree<D>(UnitGrid<D>(), points).leaf_count();
  LeafTree<D> tree;
  EXPECT_TRUE(tree.Build(UnitGrid<D>(), points, needed, 1, context).ok());
  const absl::Status refused = tree.Build(UnitGrid<D>(), points, needed - 1, 1, context);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("more than " + std::to_string(needed - 1) + " leaves"));
}

TYPED_TEST(TreeTest, BuildCanBeCancelled) {
  constexpr int D = TypeParam::kValue;
  const std::vector<Point<D>> points = test::SortedCloud<D>("uniform", 2000);
  LeafTree<D> tree;
  RunContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(tree.Build(UnitGrid<D>(), points, kManyLeaves, 1, cancelled).code(), absl::StatusCode::kCancelled);
  RunContext late;
  late.ExceedDeadline();
  EXPECT_EQ(tree.Build(UnitGrid<D>(), points, kManyLeaves, 1, late).code(), absl::StatusCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace wellspace::core
