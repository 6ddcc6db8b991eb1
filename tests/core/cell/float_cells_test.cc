// Cells in the plane and in space, where they differ from those beyond; polytope_test.cc has the tests for all.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/cell/meeting_point.h"
#include "core/cell/polytope.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::SplitMix64;

constexpr VertexId kSite{0};
// A multiple of the positions that are read together.
constexpr size_t kPadding = 8;

std::vector<VectorUnit> Units() {
  std::vector<VectorUnit> units = {VectorUnit::kBaseline};
  if (Has(VectorUnit::kAvx2)) {
    units.push_back(VectorUnit::kAvx2);
  }
  return units;
}

template <int D>
Point<D> DrawPoint(int bits, SplitMix64& random) {
  Point<D> p;
  for (double& x : p) {
    x = static_cast<double>(random.Below(uint64_t{1} << bits));
  }
  return p;
}

// The site, then others, in a cube of side 2^bits: with few bits there are many ties.
template <int D>
std::vector<Point<D>> DrawPoints(size_t count, int bits, SplitMix64& random) {
  std::vector<Point<D>> points;
  while (points.size() < count) {
    const Point<D> p = DrawPoint<D>(bits, random);
    if (std::find(points.begin(), points.end(), p) == points.end()) {
      points.push_back(p);
    }
  }
  return points;
}

template <int D>
void BeginIn(double low, double high, const Point<D>& site, TieRule rule, Polytope<D>& cell) {
  Box<D> box;
  box.low.fill(low);
  box.high.fill(high);
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  cell.Reset(site, box, kinds, rule);
}

// Cuts by all, the site among them, in portions of `together`.
template <int D>
void CutByAll(std::vector<Point<D>> points, size_t together, Polytope<D>& cell) {
  std::vector<VertexId> names;
  for (uint32_t u = 0; u < points.size(); ++u) {
    names.push_back(VertexId{u});
  }
  const size_t count = points.size();
  points.resize(count + kPadding, points[0]);
  names.resize(count + kPadding, kSite);
  for (size_t begin = 0; begin < count; begin += together) {
    cell.CutByEach({&points[begin], std::min(together, count - begin)}, {.listed = &names[begin]}, kSite);
  }
}

// Of the nodes, placed, the generators, walls beyond all vertices, with where they are.
template <int D>
struct NamedNode {
  std::array<uint32_t, D> name;
  Point<D> x;
  bool operator==(const NamedNode&) const = default;
  auto operator<=>(const NamedNode&) const = default;
};
template <int D>
std::vector<NamedNode<D>> NodesOf(Polytope<D>& cell) {
  cell.Place();
  std::vector<NamedNode<D>> nodes;
  for (const CellNode<D>& node : cell.nodes()) {
    NamedNode<D> named{{}, node.x};
    for (int k = 0; k < D; ++k) {
      const Plane<D>& plane = cell.plane(node.planes[k]);
      named.name[k] = plane.kind == PlaneKind::kBisector ? Index(plane.vertex) : 1'000'000u + plane.face;
    }
    nodes.push_back(named);
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}
template <int D>
std::vector<std::array<uint32_t, D>> NamesOf(Polytope<D>& cell) {
  std::vector<std::array<uint32_t, D>> names;
  for (const NamedNode<D>& node : NodesOf<D>(cell)) {
    names.push_back(node.name);
  }
  return names;
}

template <typename T>
class FloatCellsTest : public test::SeededTest {
 protected:
  FloatCellsTest() : SeededTest(1850) {}
};
TYPED_TEST_SUITE(FloatCellsTest, test::UpTo3);

TYPED_TEST(FloatCellsTest, VerticesAtOnceCutAsOneByOneWithEveryUnit) {
  constexpr int D = TypeParam::kValue;
  int tied = 0;
  for (int i = 0; i < 200; ++i) {
    const int bits = i % 2 == 0 ? ByDimension<D>({3, 2}) : 20;
    // Where ties are kept, nodes in the same place depend on the order.
    const TieRule rule = i % 4 == 1 ? TieRule::kKeep : TieRule::kPerturb;
    const auto points = DrawPoints<D>(2 + this->random_.Below(bits < 20 ? 50 : 150), bits, this->random_);
    const double side = std::ldexp(1.0, bits);
    Polytope<D> expected;
    BeginIn<D>(-1, side, points[0], rule, expected);
    for (uint32_t u = 1; u < points.size(); ++u) {
      expected.Cut(VertexId{u}, points[u]);
    }
    const auto nodes = NodesOf<D>(expected);
    tied += expected.counters().exact > 0 ? 1 : 0;
    for (const VectorUnit unit : Units()) {
      for (const size_t together : {size_t{5}, size_t{48}, kMostCutTogether}) {
        Polytope<D> cell(unit);
        BeginIn<D>(-1, side, points[0], rule, cell);
        CutByAll<D>(points, together, cell);
        ASSERT_EQ(NodesOf<D>(cell), nodes);
      }
    }
  }
  EXPECT_GT(tied, 50);
}

TYPED_TEST(FloatCellsTest, EveryUnitTellsTheSame) {
  constexpr int D = TypeParam::kValue;
  if (!Has(VectorUnit::kAvx2)) {
    GTEST_SKIP() << "this processor has one unit";
  }
  int kept = 0;
  int reached = 0;
  for (int i = 0; i < 300; ++i) {
    const auto points = DrawPoints<D>(60, 20, this->random_);
    Polytope<D> baseline(VectorUnit::kBaseline);
    Polytope<D> wide(VectorUnit::kAvx2);
    for (Polytope<D>* cell : {&baseline, &wide}) {
      BeginIn<D>(-1, 0x1p20, points[0], TieRule::kPerturb, *cell);
      CutByAll<D>(points, 48, *cell);
    }
    ASSERT_EQ(baseline.reach_sq(), wide.reach_sq());
    ASSERT_EQ(baseline.cuts(), wide.cuts());
    for (double ratio = 0.5; ratio < 4; ratio *= 1.1) {
      ASSERT_EQ(baseline.KeepsRatio(ratio), wide.KeepsRatio(ratio));
      kept += wide.KeepsRatio(ratio) ? 1 : 0;
    }
    for (int j = 0; j < 20; ++j) {
      Box<D> cube{DrawPoint<D>(20, this->random_), {}};
      cube.high = cube.low;
      for (double& x : cube.high) {
        x += 1000;
      }
      ASSERT_EQ(baseline.Reaches(cube), wide.Reaches(cube));
      reached += wide.Reaches(cube) ? 1 : 0;
    }
  }
  EXPECT_GT(kept, 0);
  EXPECT_GT(reached, 0);
}

class PolygonTest : public test::SeededTest {
 protected:
  PolygonTest() : SeededTest(73) {}
};

// A line that cells are surely before has no node beyond it, and no other is in doubt but where one is near.
TEST_F(PolygonTest, CellsAreSurelyBeforeLinesBeyondAllNodes) {
  int before = 0;
  int in_doubt = 0;
  for (int i = 0; i < 500; ++i) {
    const size_t count = 2 + random_.Below(40);
    Polytope<2> cell;
    const auto points = DrawPoints<2>(count, 10, random_);
    BeginIn<2>(-1, 1024, points[0], TieRule::kPerturb, cell);
    CutByAll<2>(points, 48, cell);
    Polytope<2> placed = cell;
    placed.Place();
    for (int j = 0; j < 20; ++j) {
      const double angle = 2 * std::numbers::pi * random_.Unit();
      const double distance = 1000 * random_.Unit();
      const Point<2> normal = {std::cos(angle), std::sin(angle)};
      double most = 0;
      for (const CellNode<2>& node : placed.nodes()) {
        most = std::max(most, Dot<2>(node.x, normal));
      }
      const bool is_before = cell.IsSurelyBefore({distance * normal[0], distance * normal[1]});
      EXPECT_FALSE(is_before && most > distance);
      before += is_before ? 1 : 0;
      in_doubt += !is_before && most < distance - 0.1 ? 1 : 0;
    }
  }
  EXPECT_GT(before, 1000);
  EXPECT_EQ(in_doubt, 0);
}

// Nodes are placed side by side with as many as a vector holds; each is to be where it would be alone.
TYPED_TEST(FloatCellsTest, NodesArePlacedAsOneByOneAndKnowTheirNeighbours) {
  constexpr int D = TypeParam::kValue;
  int nearly_dependent = 0;
  for (int i = 0; i < 200; ++i) {
    auto points = DrawPoints<D>(3 + this->random_.Below(60), 30, this->random_);
    if (i % 2 == 0) {  // bisectors that are nearly the same, so that nodes are placed exactly
      for (size_t u = 2; u < points.size(); u += 2) {
        points[u] = points[u - 1];
        points[u][u / 2 % D] += 0x1p-20;
      }
    }
    for (const VectorUnit unit : Units()) {
      Polytope<D> cell(unit);
      BeginIn<D>(-1, 0x1p30, points[0], TieRule::kPerturb, cell);
      CutByAll<D>(points, 48, cell);
      cell.Place();
      double reach = 0;
      for (uint32_t n = 0; n < cell.nodes().size(); ++n) {
        const CellNode<D>& node = cell.nodes()[n];
        std::array<const Plane<D>*, D> planes;
        for (int k = 0; k < D; ++k) {
          planes[k] = &cell.plane(node.planes[k]);
          const CellNode<D>& other = cell.nodes()[node.neighbours[k]];
          EXPECT_NE(std::find(other.neighbours.begin(), other.neighbours.end(), n), other.neighbours.end());
          for (int j = 0; j < D; ++j) {
            const bool is_shared =
                std::find(other.planes.begin(), other.planes.end(), node.planes[j]) != other.planes.end();
            EXPECT_EQ(is_shared, j != k);
          }
        }
        Point<D> x;
        const double slack = PlaceByPlanes<D>(cell.site(), planes, x);
        EXPECT_EQ(node.x, x);
        EXPECT_EQ(node.slack, slack);
        EXPECT_EQ(node.radius_sq, NormSq<D>(x));
        EXPECT_EQ(node.reach, std::sqrt(NormSq<D>(x)) + slack);
        reach = std::max(reach, node.reach);
        nearly_dependent += Meet<D>(planes).error > kPlacedError * std::sqrt(NormSq<D>(x)) ? 1 : 0;
      }
      EXPECT_LE(cell.reach_sq(), reach * reach);
    }
  }
  EXPECT_GT(nearly_dependent, 50);
}

// More nodes and planes than one vector or word holds, and a cell that has them no more.
TYPED_TEST(FloatCellsTest, ManyNodesComeAndGo) {
  constexpr int D = TypeParam::kValue;
  for (const VectorUnit unit : Units()) {
    for (const uint32_t count : {7u, 8u, 9u, 10u, 17u, 33u, 300u}) {
      std::vector<Point<D>> points(1, Point<D>{});
      for (uint32_t u = 1; u <= count; ++u) {
        // Spirals from pole to pole, each point apart from the next by the golden angle; in the plane a regular
        // polygon.
        const double z = D == 3 ? 1 - (2 * u - 1.0) / count : 0;
        const double angle = (D == 3 ? std::numbers::pi * (3 - std::sqrt(5)) : 2 * std::numbers::pi / count) * u;
        Point<D> p{};
        p[0] = std::sqrt(1 - z * z) * std::cos(angle);
        p[1] = std::sqrt(1 - z * z) * std::sin(angle);
        if constexpr (D == 3) {
          p[2] = z;
        }
        points.push_back(p);
      }
      Polytope<D> cell(unit);
      BeginIn<D>(-4, 4, points[0], TieRule::kPerturb, cell);
      for (uint32_t u = 1; u <= count; ++u) {
        EXPECT_TRUE(cell.Cut(VertexId{u}, points[u]));
      }
      EXPECT_EQ(cell.nodes().size(), D == 2 ? count : 2 * count - 4);
      Star<D> star;
      cell.FindStar(star);
      EXPECT_EQ(star.size(), cell.nodes().size());
      double farthest = 0;
      for (const CellNode<D>& node : cell.nodes()) {
        farthest = std::max(farthest, std::sqrt(node.radius_sq));
      }
      EXPECT_TRUE(cell.KeepsRatio(farthest * 1.001));
      EXPECT_FALSE(cell.KeepsRatio(farthest * 0.999));
      EXPECT_NEAR(std::sqrt(cell.reach_sq()), farthest, 1e-5);
      Polytope<D> same(unit);
      BeginIn<D>(-4, 4, points[0], TieRule::kPerturb, same);
      CutByAll<D>(points, 48, same);
      EXPECT_EQ(NodesOf<D>(same), NodesOf<D>(cell));
      // A simplex about the site is left.
      for (int k = 0; k <= D; ++k) {
        Point<D> near;
        near.fill(k == D ? -0.1 : 0);
        if (k < D) {
          near[k] = 0.2;
        }
        EXPECT_TRUE(cell.Cut(VertexId{count + 1 + static_cast<uint32_t>(k)}, near));
      }
      EXPECT_EQ(cell.nodes().size(), static_cast<size_t>(D + 1));
    }
  }
}

// Far below distances from the site that floats can tell, all is decided exactly.
TYPED_TEST(FloatCellsTest, VerticesMayBeVeryNear) {
  constexpr int D = TypeParam::kValue;
  std::vector<Point<D>> unscaled(1, Point<D>{});
  for (int k = 0; k < D; ++k) {
    unscaled.emplace_back();
    unscaled.back()[k] = 1;
  }
  unscaled.emplace_back();
  unscaled.back().fill(-1);
  Polytope<D> expected;
  BeginIn<D>(-4, 4, unscaled[0], TieRule::kPerturb, expected);
  CutByAll<D>(unscaled, unscaled.size(), expected);
  const auto nodes = NodesOf<D>(expected);
  ASSERT_EQ(nodes.size(), static_cast<size_t>(D + 1));
  for (const VectorUnit unit : Units()) {
    for (const int exponent : {-60, -150, ByDimension<D>({-300, -200})}) {
      std::vector<Point<D>> points = unscaled;
      for (Point<D>& p : points) {
        for (double& x : p) {
          x = std::ldexp(x, exponent);
        }
      }
      Point<D> far;
      far.fill(1);
      points.push_back(far);
      Polytope<D> cell(unit);
      BeginIn<D>(-4, 4, points[0], TieRule::kPerturb, cell);
      CutByAll<D>(points, points.size(), cell);
      auto near = NodesOf<D>(cell);
      for (NamedNode<D>& node : near) {
        for (double& x : node.x) {
          x = std::ldexp(x, -exponent);
        }
      }
      EXPECT_EQ(near, nodes) << "2^" << exponent;
    }
  }
}

TYPED_TEST(FloatCellsTest, UnitsOfLengthDoNotMatter) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 50; ++i) {
    const auto points = DrawPoints<D>(40, 10, this->random_);
    Polytope<D> cell;
    BeginIn<D>(-1, 1024, points[0], TieRule::kPerturb, cell);
    CutByAll<D>(points, 48, cell);
    const auto names = NamesOf<D>(cell);
    for (const int exponent : {ByDimension<D>({-300, -200}), -10, ByDimension<D>({300, 200})}) {
      std::vector<Point<D>> scaled = points;
      for (Point<D>& p : scaled) {
        for (double& x : p) {
          x = std::ldexp(x, exponent);
        }
      }
      BeginIn<D>(std::ldexp(-1.0, exponent), std::ldexp(1024.0, exponent), scaled[0], TieRule::kPerturb, cell);
      CutByAll<D>(scaled, 48, cell);
      ASSERT_EQ(NamesOf<D>(cell), names) << "units of 2^" << exponent;
    }
  }
}

// A grid but for noise: nodes fall together but for as much, and their planes are nearly dependent.
TYPED_TEST(FloatCellsTest, NoisyGridsAreCutAsOneByOne) {
  constexpr int D = TypeParam::kValue;
  for (const double noise : {0x1p-48, 0x1p-40, 0x1p-30, 0x1p-24, 0x1p-18, 0x1p-12}) {
    for (int i = 0; i < 10; ++i) {
      auto points = DrawPoints<D>(ByDimension<D>({20, 50}), 2 + (D == 2 ? 1 : 0), this->random_);
      for (Point<D>& p : points) {
        for (double& x : p) {
          x += noise * static_cast<double>(this->random_.Below(16));
        }
      }
      Polytope<D> expected;
      BeginIn<D>(-1, 9, points[0], TieRule::kPerturb, expected);
      for (uint32_t u = static_cast<uint32_t>(points.size()) - 1; u > 0; --u) {
        expected.Cut(VertexId{u}, points[u]);
      }
      Polytope<D> cell;
      BeginIn<D>(-1, 9, points[0], TieRule::kPerturb, cell);
      CutByAll<D>(points, 48, cell);
      ASSERT_EQ(NodesOf<D>(cell), NodesOf<D>(expected)) << "noise " << noise;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
