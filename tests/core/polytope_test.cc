// Cells under construction, against half-space intersection by all D-subsets of planes in integers.
#include "core/voronoi/polytope.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

using test::IntegerPoint;
using test::IsSimplePolytope;
using test::NamesOf;
using test::Seed;
using test::SplitMix64;
using test::ToPoint;

template <int D>
std::array<PlaneKind, 2 * D> Faces() {
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  return kinds;
}

// Distinct vertices in the box [low, high].
template <int D>
struct IntegerCloud {
  std::vector<IntegerPoint<D>> vertices;
  IntegerPoint<D> low;
  IntegerPoint<D> high;

  Box<D> Bounds() const { return {ToPoint<D>(low), ToPoint<D>(high)}; }
};

template <int D>
IntegerCloud<D> DrawGridCloud(int64_t range, size_t count, SplitMix64& random) {
  IntegerCloud<D> cloud;
  cloud.low.fill(0);
  cloud.high.fill(range - 1);
  std::set<IntegerPoint<D>> seen;
  while (cloud.vertices.size() < count) {
    IntegerPoint<D> p;
    for (int64_t& x : p) {
      x = static_cast<int64_t>(random.Below(range));
    }
    if (seen.insert(p).second) {
      cloud.vertices.push_back(p);
    }
  }
  return cloud;
}

// Lattice points of the circle of radius 65 or the sphere of radius 15, antipodes among them, and its centre not.
template <int D>
IntegerCloud<D> DrawSphereCloud(size_t count, SplitMix64& random) {
  const int64_t radius = D == 2 ? 65 : 15;
  std::set<IntegerPoint<D>> seen;
  IntegerCloud<D> cloud;
  cloud.low.fill(-100);
  cloud.high.fill(100);
  while (cloud.vertices.size() < count) {
    IntegerPoint<D> p;
    int64_t length_sq = 0;
    for (int64_t& x : p) {
      x = static_cast<int64_t>(random.Below(2 * radius + 1)) - radius;
      length_sq += x * x;
    }
    if (length_sq != radius * radius) {
      continue;
    }
    for (int sign = 0; sign < 2 && cloud.vertices.size() < count; ++sign) {
      if (seen.insert(p).second) {
        cloud.vertices.push_back(p);
      }
      for (int64_t& x : p) {
        x = -x;
      }
    }
  }
  return cloud;
}

template <int D>
std::vector<size_t> DrawOrder(const IntegerCloud<D>& cloud, size_t site, SplitMix64& random) {
  std::vector<size_t> order;
  for (size_t i = 0; i < cloud.vertices.size(); ++i) {
    if (i != site) {
      order.insert(order.begin() + static_cast<std::ptrdiff_t>(random.Below(order.size() + 1)), i);
    }
  }
  return order;
}

template <int D>
void CutAll(const IntegerCloud<D>& cloud, size_t site, const std::vector<size_t>& order, TieRule rule,
            Polytope<D>& cell) {
  cell.Reset(ToPoint<D>(cloud.vertices[site]), cloud.Bounds(), Faces<D>(), rule);
  for (const size_t u : order) {
    cell.Cut(VertexId(u), ToPoint<D>(cloud.vertices[u]));
  }
}

// Whether each of the exact positions has a node of the cell, and each node an exact position.
template <int D>
::testing::AssertionResult HasNodesAt(const Polytope<D>& cell, const std::set<Point<D>>& positions) {
  const auto are_near = [](const Point<D>& a, const Point<D>& b) { return DistanceSq<D>(a, b) < 1e-16; };
  for (const CellNode<D>& node : cell.nodes()) {
    if (std::none_of(positions.begin(), positions.end(), [&](const auto& x) { return are_near(x, node.x); })) {
      return ::testing::AssertionFailure() << "the node " << ::testing::PrintToString(node.x) << " is none";
    }
  }
  for (const Point<D>& x : positions) {
    if (std::none_of(cell.nodes().begin(), cell.nodes().end(), [&](const auto& node) { return are_near(x, node.x); })) {
      return ::testing::AssertionFailure() << "the node " << ::testing::PrintToString(x) << " is missing";
    }
  }
  return ::testing::AssertionSuccess();
}

template <typename T>
class PolytopeTest : public ::testing::Test {
 protected:
  PolytopeTest() : trace_(__FILE__, __LINE__, "seed " + std::to_string(seed_)) {}

  const uint64_t seed_ = Seed(1983);
  SplitMix64 random_{seed_};
  ::testing::ScopedTrace trace_;
};
TYPED_TEST_SUITE(PolytopeTest, test::Dimensions);

TYPED_TEST(PolytopeTest, BeginsAsTheBox) {
  constexpr int D = TypeParam::kValue;
  Box<D> box;
  Point<D> site;
  double reach_sq = 0;
  for (int k = 0; k < D; ++k) {
    box.low[k] = -1 - k;
    box.high[k] = 3;
    site[k] = 1;
    reach_sq += std::max(2.0 + k, 2.0) * std::max(2.0 + k, 2.0);
  }
  Polytope<D> cell;
  cell.Reset(site, box, Faces<D>(), TieRule::kKeep);
  EXPECT_TRUE(IsSimplePolytope<D>(cell));
  EXPECT_EQ(cell.nodes().size(), size_t{1} << D);
  EXPECT_EQ(cell.plane_count(), 2 * D);
  EXPECT_NEAR(cell.reach_sq(), reach_sq, 1e-12);
  for (const CellNode<D>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = cell.plane(index);
      EXPECT_EQ(node.x[plane.face / 2] + site[plane.face / 2], box.FaceCoordinate(plane.face));
      EXPECT_EQ(plane.kind, PlaneKind::kFace);
    }
  }
}

// Guarantee (2), where all nodes are simple and where there are ties: grids, vertices on the walls.
TYPED_TEST(PolytopeTest, PerturbedCellIsThatOfTheWeightedVertices) {
  constexpr int D = TypeParam::kValue;
  uint64_t perturbed = 0;
  for (const int64_t range : {3, 4, 1000}) {
    for (int i = 0; i < (D == 2 ? 30 : 6); ++i) {
      const IntegerCloud<D> cloud = DrawGridCloud<D>(range, D == 2 ? 8 : 10, this->random_);
      Polytope<D> cell;
      CutAll<D>(cloud, 0, DrawOrder<D>(cloud, 0, this->random_), TieRule::kPerturb, cell);
      ASSERT_TRUE(IsSimplePolytope<D>(cell));
      const auto exact = test::ComputeExactCell<D>(cloud.vertices, 0, cloud.low, cloud.high, true);
      ASSERT_EQ(NamesOf<D>(cell), exact.names) << ::testing::PrintToString(cloud.vertices);
      ASSERT_EQ(cell.nodes().size(), exact.names.size());
      perturbed += cell.counters().perturbed;
    }
  }
  EXPECT_GT(perturbed, 20u) << "these clouds ought to have ties";
}

TYPED_TEST(PolytopeTest, KeptCellHasTheNodesOfTheUnweightedOne) {
  constexpr int D = TypeParam::kValue;
  for (const int64_t range : {3, 4, 1000}) {
    for (int i = 0; i < (D == 2 ? 30 : 6); ++i) {
      const IntegerCloud<D> cloud = DrawGridCloud<D>(range, D == 2 ? 8 : 10, this->random_);
      Polytope<D> cell;
      CutAll<D>(cloud, 0, DrawOrder<D>(cloud, 0, this->random_), TieRule::kKeep, cell);
      ASSERT_TRUE(IsSimplePolytope<D>(cell));
      ASSERT_EQ(cell.counters().perturbed, 0u);
      const auto exact = test::ComputeExactCell<D>(cloud.vertices, 0, cloud.low, cloud.high, false);
      ASSERT_TRUE(HasNodesAt<D>(cell, exact.positions)) << ::testing::PrintToString(cloud.vertices);
    }
  }
}

TYPED_TEST(PolytopeTest, CosphericalVerticesGiveOneCellInAnyOrder) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 4; ++i) {
    const IntegerCloud<D> cloud = DrawSphereCloud<D>(D == 2 ? 24 : 12, this->random_);
    Polytope<D> cell;
    const auto exact = test::ComputeExactCell<D>(cloud.vertices, 0, cloud.low, cloud.high, true);
    for (int j = 0; j < 40; ++j) {
      CutAll<D>(cloud, 0, DrawOrder<D>(cloud, 0, this->random_), TieRule::kPerturb, cell);
      ASSERT_EQ(NamesOf<D>(cell), exact.names);
    }
    for (int j = 0; j < 10; ++j) {
      CutAll<D>(cloud, 0, DrawOrder<D>(cloud, 0, this->random_), TieRule::kKeep, cell);
      ASSERT_TRUE(HasNodesAt<D>(cell, exact.positions));
    }
  }
}

// Guarantees (1) and (2), Cut's result and Reaches, after each cut.
TYPED_TEST(PolytopeTest, EachCutOnlyRemoves) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 10; ++i) {
    const IntegerCloud<D> cloud = DrawGridCloud<D>(i % 2 == 0 ? 5 : 1000, 20, this->random_);
    const Point<D> site = ToPoint<D>(cloud.vertices[0]);
    Polytope<D> cell;
    cell.Reset(site, cloud.Bounds(), Faces<D>(), i % 4 < 2 ? TieRule::kKeep : TieRule::kPerturb);
    uint64_t cuts = 0;
    for (const size_t u : DrawOrder<D>(cloud, 0, this->random_)) {
      const Point<D> position = ToPoint<D>(cloud.vertices[u]);
      const auto before = NamesOf<D>(cell);
      const double reach_sq = cell.reach_sq();
      const bool reaches = cell.Reaches(Box<D>{position, position});
      const bool has_cut = cell.Cut(VertexId(u), position);
      ASSERT_TRUE(IsSimplePolytope<D>(cell));
      ASSERT_TRUE(reaches || !has_cut) << "a vertex that Reaches excludes has cut";
      ASSERT_EQ(has_cut, NamesOf<D>(cell) != before);
      ASSERT_LE(cell.reach_sq(), reach_sq * (1 + 1e-12));
      cuts += has_cut ? 1 : 0;
      ASSERT_EQ(cell.cuts(), cuts);
      for (const CellNode<D>& node : cell.nodes()) {
        const Point<D> w = Difference<D>(position, site);
        ASSERT_LE(Dot<D>(node.x, w), 0.5 * NormSq<D>(w) * (1 + 1e-12) + 1e-9);
      }
    }
  }
}

// A vertex that has cut already cuts nothing more: its bisector is a plane of the cell.
TYPED_TEST(PolytopeTest, CuttingIsIdempotent) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 20; ++i) {
    IntegerCloud<D> cloud = DrawGridCloud<D>(1000, 12, this->random_);
    Polytope<D> cell;
    const std::vector<size_t> order = DrawOrder<D>(cloud, 0, this->random_);
    CutAll<D>(cloud, 0, order, TieRule::kKeep, cell);
    const auto names = NamesOf<D>(cell);
    for (const size_t u : order) {
      // A hair farther away than the vertex itself.
      Point<D> beyond = ToPoint<D>(cloud.vertices[u]);
      for (int k = 0; k < D; ++k) {
        const double gap = beyond[k] - cell.site()[k];
        beyond[k] = cell.site()[k] + gap * (1 + 0x1p-20);
      }
      EXPECT_FALSE(cell.Cut(VertexId(100 + u), beyond));
    }
    EXPECT_EQ(NamesOf<D>(cell), names);
  }
}

// Reaches is exact but for rounding: a box is reached where a vertex somewhere in it would cut.
TYPED_TEST(PolytopeTest, ReachesExactlyTheBoxesOfVerticesThatWouldCut) {
  constexpr int D = TypeParam::kValue;
  int reached = 0;
  int missed = 0;
  for (int i = 0; i < 10; ++i) {
    const IntegerCloud<D> cloud = DrawGridCloud<D>(1000, 15, this->random_);
    Polytope<D> cell;
    CutAll<D>(cloud, 0, DrawOrder<D>(cloud, 0, this->random_), TieRule::kKeep, cell);
    for (int j = 0; j < 100; ++j) {
      Box<D> cube;
      const double side = std::ldexp(1.0, static_cast<int>(this->random_.Below(9)));
      for (int k = 0; k < D; ++k) {
        cube.low[k] = side * std::floor(static_cast<double>(this->random_.Below(1000)) / side);
        cube.high[k] = cube.low[k] + side;
      }
      // The cube meets the ball about a node through the site?
      double margin = -1e300;
      for (const CellNode<D>& node : cell.nodes()) {
        Point<D> x;
        for (int k = 0; k < D; ++k) {
          x[k] = node.x[k] + cell.site()[k];
        }
        margin = std::max(margin, std::sqrt(node.radius_sq) - std::sqrt(DistanceSq<D>(x, cube)));
      }
      if (std::abs(margin) > 1e-6) {
        ASSERT_EQ(cell.Reaches(cube), margin > 0) << "margin " << margin;
        ++(margin > 0 ? reached : missed);
      }
    }
  }
  EXPECT_GT(reached, 50);
  EXPECT_GT(missed, 50);
}

// Lattice points of the circle of radius 5^7 13^6 about the origin, counter-clockwise: products of powers of Gaussian primes and
// their conjugates, times units. Neighbours are about 1/124 of the radius apart.
std::vector<Point<2>> LatticeCircle() {
  using Gaussian = std::array<int64_t, 2>;
  const auto times = [](const Gaussian& a, const Gaussian& b) {
    return Gaussian{a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]};
  };
  std::vector<Gaussian> points = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (const auto& [prime, exponent] : {std::pair{Gaussian{2, 1}, 7}, std::pair{Gaussian{3, 2}, 6}}) {
    // prime^j conjugate^(2 e - j) for all j, each of norm |prime|^(4 e).
    std::vector<Gaussian> next;
    for (int j = 0; j <= 2 * exponent; ++j) {
      Gaussian factor = {1, 0};
      for (int i = 0; i < 2 * exponent; ++i) {
        factor = times(factor, i < j ? prime : Gaussian{prime[0], -prime[1]});
      }
      for (const Gaussian& p : points) {
        next.push_back(times(p, factor));
      }
    }
    points = next;
  }
  std::vector<Point<2>> circle;
  for (const Gaussian& p : points) {
    circle.push_back(ToPoint<2>(p));
  }
  std::sort(circle.begin(), circle.end(),
            [](const auto& a, const auto& b) { return std::atan2(a[1], a[0]) < std::atan2(b[1], b[0]); });
  return circle;
}

// The farthest node of the site's cell is where two nearly parallel bisectors meet, in the circle's centre, so known to some digits
// less than others; and the site's antipode is at exactly twice its distance. It must not be passed over as too far to cut.
TEST(PolytopeOnACircle, AntipodeOfTheSiteIsDecidedExactly) {
  const std::vector<Point<2>> circle = LatticeCircle();
  const size_t count = circle.size();
  ASSERT_EQ(count, 780u);
  const double radius = 78125.0 * 4826809.0;
  const Box<2> bounds = {{-radius, -radius}, {radius, radius}};
  std::vector<size_t> wrong;
  for (size_t site = 0; site < count; ++site) {
    const auto cell_of = [&](const std::array<size_t, 3>& order) {
      Polytope<2> cell;
      cell.Reset(circle[site], bounds, Faces<2>(), TieRule::kPerturb);
      for (const size_t u : order) {
        cell.Cut(VertexId(u), circle[u]);
      }
      return NamesOf<2>(cell);
    };
    const size_t before = (site + count - 1) % count;
    const size_t after = (site + 1) % count;
    const size_t antipode = (site + count / 2) % count;
    if (cell_of({before, after, antipode}) != cell_of({antipode, before, after})) {
      wrong.push_back(site);
    }
  }
  EXPECT_TRUE(wrong.empty()) << wrong.size() << " of " << count << " cells depend on the order of cuts";
}

}  // namespace
}  // namespace wellspace::core
