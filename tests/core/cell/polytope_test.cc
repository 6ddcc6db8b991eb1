// The contract of cells (cell_class.h) in every dimension, against half-space intersection by all D-subsets of planes
// in integers. Guarantees are those of Cut, by number.
#include "core/cell/polytope.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>
#include <vector>

#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/exact_nodes.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::HasNodesWithinSlack;
using test::IntegerPoint;
using test::IsSimplePolytope;
using test::NamesOf;
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

// Lattice points of the circle of radius 65 or the spheres of radius 15, antipodes among them, and its centre not.
template <int D>
IntegerCloud<D> DrawSphereCloud(size_t count, SplitMix64& random) {
  const int64_t radius = ByDimension<D>({65, 15});
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
class PolytopeTest : public test::SeededTest {
 protected:
  PolytopeTest() : SeededTest(1983) {}
};
TYPED_TEST_SUITE(PolytopeTest, test::AllDimensions);

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
  cell.Place();
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
    for (int i = 0; i < ByDimension<D>({30, 6, 3, 1}); ++i) {
      const IntegerCloud<D> cloud = DrawGridCloud<D>(range, ByDimension<D>({8, 10, 8, 7, 5}), this->random_);
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
    for (int i = 0; i < ByDimension<D>({30, 6, 3, 1}); ++i) {
      const IntegerCloud<D> cloud = DrawGridCloud<D>(range, ByDimension<D>({8, 10, 8, 7, 5}), this->random_);
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
  for (int i = 0; i < ByDimension<D>({4, 4, 3, 1}); ++i) {
    const IntegerCloud<D> cloud = DrawSphereCloud<D>(ByDimension<D>({24, 12, 9, 7, 5}), this->random_);
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

// A cell that is cut by approximate positions alone, and placed at the end, is the same to the bit.
TYPED_TEST(PolytopeTest, WhenNodesArePlacedMakesNoDifference) {
  constexpr int D = TypeParam::kValue;
  const auto description = [](const Polytope<D>& cell) {
    std::vector<std::tuple<Point<D>, double, std::array<uint16_t, D>>> nodes;
    for (const CellNode<D>& node : cell.nodes()) {
      nodes.emplace_back(node.x, node.slack, node.planes);
    }
    std::sort(nodes.begin(), nodes.end());
    return nodes;
  };
  for (int i = 0; i < ByDimension<D>({40, 40, 10, 4, 2}); ++i) {
    const IntegerCloud<D> cloud =
        DrawGridCloud<D>(ByDimension<D>({i % 2 == 0 ? 8 : 100000, i % 2 == 0 ? 4 : 100000, 1000}),
                         ByDimension<D>({50, 50, 40, 20, 12}), this->random_);
    const Point<D> site = ToPoint<D>(cloud.vertices[0]);
    Polytope<D> at_once;
    Polytope<D> at_the_end;
    for (Polytope<D>* cell : {&at_once, &at_the_end}) {
      cell->Reset(site, cloud.Bounds(), Faces<D>(), i % 4 < 2 ? TieRule::kKeep : TieRule::kPerturb);
    }
    for (const size_t u : DrawOrder<D>(cloud, 0, this->random_)) {
      const Point<D> position = ToPoint<D>(cloud.vertices[u]);
      ASSERT_EQ(at_once.Cut(VertexId(u), position), at_the_end.CutBeforePlace(VertexId(u), position));
    }
    at_the_end.Place();
    ASSERT_TRUE(IsSimplePolytope<D>(at_the_end));
    ASSERT_TRUE(HasNodesWithinSlack<D>(at_the_end));
    ASSERT_EQ(description(at_the_end), description(at_once));
  }
}

// Guarantees (1) and (2), Cut's result and Reaches, after each cut.
TYPED_TEST(PolytopeTest, EachCutOnlyRemoves) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < ByDimension<D>({10, 10, 10, 4}); ++i) {
    const IntegerCloud<D> cloud =
        DrawGridCloud<D>(i % 2 == 0 ? 5 : 1000, ByDimension<D>({20, 20, 20, 12, 8}), this->random_);
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
      ASSERT_TRUE(HasNodesWithinSlack<D>(cell));
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

// Until it is tightened the reach may be that of before; then it is that of the farthest node, but for its slack.
TYPED_TEST(PolytopeTest, TightenedReachIsThatOfTheFarthestNode) {
  constexpr int D = TypeParam::kValue;
  int looser = 0;
  for (int i = 0; i < 10; ++i) {
    const IntegerCloud<D> cloud = DrawGridCloud<D>(1000, ByDimension<D>({20, 20, 20, 12, 8}), this->random_);
    const Point<D> site = ToPoint<D>(cloud.vertices[0]);
    Polytope<D> cell;
    cell.Reset(site, cloud.Bounds(), Faces<D>(), TieRule::kPerturb);
    for (const size_t u : DrawOrder<D>(cloud, 0, this->random_)) {
      cell.CutBeforePlace(VertexId(u), ToPoint<D>(cloud.vertices[u]));
      const double before = cell.reach_sq();
      cell.Tighten();
      ASSERT_LE(cell.reach_sq(), before);
      looser += cell.reach_sq() < before ? 1 : 0;
    }
    const double tightened = cell.reach_sq();
    cell.Place();
    double farthest_sq = 0;
    for (const CellNode<D>& node : cell.nodes()) {
      farthest_sq = std::max(farthest_sq, node.radius_sq);
    }
    ASSERT_GE(tightened, farthest_sq * (1 - 1e-12));
    ASSERT_LE(tightened, farthest_sq * (1 + 1e-5));
  }
  EXPECT_TRUE(looser > 0 || D <= 3) << "in the plane and in space it is always tight";
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

// ---- Positions of nodes

// D planes through the neighbourhood of one site: bisectors and walls, the last one as dependent on the others as `gap`
// says, of length 1 if it is 1.
template <int D>
std::array<PlaneSource<D>, D> DrawPlanes(const Point<D>& site, double gap, SplitMix64& random) {
  std::array<PlaneSource<D>, D> planes;
  Point<D> last{};
  for (int j = 0; j < D; ++j) {
    PlaneSource<D>& plane = planes[j];
    if (j + 1 < D && random.Below(4) == 0) {
      plane.axis = static_cast<int>(random.Below(D));
      plane.coordinate = site[plane.axis] + random.Unit();
      last[plane.axis] += random.Unit();
      continue;
    }
    const double factor = random.Unit() - 0.5;
    for (int k = 0; k < D; ++k) {
      const double w = j + 1 < D ? random.Unit() - 0.5 : last[k] + gap * (random.Unit() - 0.5);
      plane.generator[k] = site[k] + w;
      last[k] += factor * w;
    }
  }
  return planes;
}

// Guarantee (1) of ExactMeetingPoint, also where a double more or less turns the planes around.
TYPED_TEST(PolytopeTest, ExactMeetingPointIsRightTo50Bits) {
  constexpr int D = TypeParam::kValue;
  int met = 0;
  for (int i = 0; i < 600; ++i) {
    const double scale = i % 5 == 0 ? 0x1p-30 : i % 7 == 0 ? 1e5 : 1;
    Point<D> site;
    for (double& x : site) {
      x = i % 3 == 0 ? 0 : scale * (this->random_.Unit() - 0.5);
    }
    const auto planes = DrawPlanes<D>(site, std::ldexp(1.0, -(i % 60)), this->random_);
    if (test::DoMeet<D>(site, planes)) {
      ++met;
      ASSERT_TRUE(test::IsMeetingPointTo<D>(50, site, planes, ExactMeetingPoint<D>(site, planes)))
          << "planes dependent to " << i % 60 << " bits";
    }
  }
  EXPECT_GT(met, 300);
}

// Where the bound of a node's error comes from a determinant (D <= 3) or a residual: few planes, so that nodes are
// where many shapes of cells have them, in boxes whose planes are more and more nearly dependent on the bisectors.
TYPED_TEST(PolytopeTest, NodesAreWithinTheirSlackOfWherePlanesMeet) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < ByDimension<D>({300, 200, 60, 20, 8}); ++i) {
    const double flatness = std::ldexp(1.0, -(i % 53));
    const int flat_axes = 1 + static_cast<int>(this->random_.Below(D - 1));
    Box<D> box;
    box.low.fill(-1);
    box.high.fill(1);
    Point<D> site;
    for (double& x : site) {
      x = i % 2 == 0 ? 0 : 1e-3 * this->random_.Unit();
    }
    Polytope<D> cell;
    cell.Reset(site, box, Faces<D>(), i % 4 < 2 ? TieRule::kKeep : TieRule::kPerturb);
    for (uint32_t u = 0; u < D + 6; ++u) {
      Point<D> p = site;
      for (int k = 0; k < D; ++k) {
        p[k] += (k < flat_axes ? flatness : 1) * (2 * this->random_.Unit() - 1);
      }
      cell.Cut(VertexId{u}, p);
    }
    ASSERT_TRUE(IsSimplePolytope<D>(cell));
    ASSERT_TRUE(HasNodesWithinSlack<D>(cell)) << "flat to " << i % 53 << " bits";
  }
}

// Vertices on one sphere of D - 1 coordinates, a few units of 2^-50 apart in the last one: along that axis, in the
// sphere's centre, the cell has nodes whose planes are as nearly dependent, so that no bound is to be had in doubles.
TYPED_TEST(PolytopeTest, NodesOfNearlyDependentPlanesArePlacedExactly) {
  constexpr int D = TypeParam::kValue;
  int placed_exactly = 0;
  for (int i = 0; i < ByDimension<D>({40, 40, 20, 6, 3}); ++i) {
    // Radius 5 about the origin: all permutations of (3, 4, 0, ...) and (5, 0, ...), with signs.
    const auto draw = [&] {
      Point<D> p{};
      if (D == 2 || this->random_.Below(3) == 0) {
        p[this->random_.Below(D - 1)] = this->random_.Below(2) == 0 ? 5 : -5;
      } else {
        const uint64_t axis = this->random_.Below(D - 1);
        const uint64_t other = (axis + 1 + this->random_.Below(D - 2)) % (D - 1);
        p[axis] = this->random_.Below(2) == 0 ? 3 : -3;
        p[other] = this->random_.Below(2) == 0 ? 4 : -4;
      }
      return p;
    };
    const Point<D> site = draw();
    std::vector<Point<D>> others;
    while (others.size() < 2 * D + 2) {
      Point<D> p = draw();
      if (p != site) {
        p[D - 1] = 0x1p-50 * (static_cast<double>(this->random_.Below(33)) - 16);
        others.push_back(p);
      }
    }
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    Box<D> box;
    box.low.fill(-8);
    box.high.fill(8);
    std::set<test::NodeName<D>> names;
    for (int order = 0; order < 3; ++order) {
      Polytope<D> cell;
      cell.Reset(site, box, Faces<D>(), order == 0 ? TieRule::kKeep : TieRule::kPerturb);
      for (size_t j = 0; j < others.size(); ++j) {
        const size_t u = order < 2 ? j : others.size() - 1 - j;
        cell.Cut(VertexId(u), others[u]);
      }
      ASSERT_TRUE(IsSimplePolytope<D>(cell));
      ASSERT_TRUE(HasNodesWithinSlack<D>(cell));
      for (const CellNode<D>& node : cell.nodes()) {
        // The bounds of doubles are larger by far.
        const bool is_corner = std::all_of(node.planes.begin(), node.planes.end(),
                                           [&](uint16_t index) { return cell.plane(index).source.IsWall(); });
        placed_exactly += !is_corner && node.slack < 25 * 0x1p-53 * std::sqrt(node.radius_sq) ? 1 : 0;
      }
      if (order == 1) {
        names = NamesOf<D>(cell);
      } else if (order == 2) {
        ASSERT_EQ(NamesOf<D>(cell), names) << "depends on the order of cuts";
      }
    }
  }
  EXPECT_GT(placed_exactly, 10);
}

// Lattice points of the circle of radius 5^7 13^6 about the origin, counter-clockwise: products of powers of Gaussian
// primes and their conjugates, times units. Neighbours are about 1/124 of the radius apart.
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

// The farthest node of the site's cell is where two nearly parallel bisectors meet, in the circle's centre, so known to
// some digits less than others; and the site's antipode is at exactly twice its distance. It must not be passed over as
// too far to cut.
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
