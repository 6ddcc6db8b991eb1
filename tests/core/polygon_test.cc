// What a cell in the plane does otherwise than one in space; polytope_test.cc has what both do.
#include "core/voronoi/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "core/voronoi/polytope.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::SplitMix64;

constexpr std::array<PlaneKind, 4> kFaces = {PlaneKind::kFace, PlaneKind::kFace, PlaneKind::kFace, PlaneKind::kFace};
constexpr VertexId kSite{0};

std::vector<VectorUnit> Units() {
  std::vector<VectorUnit> units = {VectorUnit::kBaseline};
  if (Has(VectorUnit::kAvx2)) {
    units.push_back(VectorUnit::kAvx2);
  }
  return units;
}

// The site, then others, in a square of side 2^bits: with few bits there are many ties.
std::vector<Point<2>> DrawPoints(size_t count, int bits, SplitMix64& random) {
  std::vector<Point<2>> points;
  while (points.size() < count) {
    const Point<2> p = {static_cast<double>(random.Below(uint64_t{1} << bits)),
                        static_cast<double>(random.Below(uint64_t{1} << bits))};
    if (std::find(points.begin(), points.end(), p) == points.end()) {
      points.push_back(p);
    }
  }
  return points;
}

void Begin(const std::vector<Point<2>>& points, int bits, TieRule rule, Polygon& cell) {
  const double side = std::ldexp(1.0, bits);
  cell.Reset(points[0], {{-1, -1}, {side, side}}, kFaces, rule);
}

// Cuts by all, the site among them, in portions of `together`.
void CutByAll(std::vector<Point<2>> points, size_t together, Polygon& cell) {
  std::vector<VertexId> names;
  for (uint32_t u = 0; u < points.size(); ++u) {
    names.push_back(VertexId{u});
  }
  const size_t count = points.size();
  points.resize(count + Polygon::kTogether, points[0]);
  names.resize(count + Polygon::kTogether, kSite);
  for (size_t begin = 0; begin < count; begin += together) {
    cell.CutByEach({&points[begin], std::min(together, count - begin)}, {.listed = &names[begin]}, kSite);
  }
}

// By node its generators, in the order of the nodes around the site, from the least on; walls have numbers beyond all vertices.
std::vector<std::array<uint32_t, 2>> NamesAround(Polygon& cell) {
  cell.Place();
  std::vector<std::array<uint32_t, 2>> names;
  for (const CellNode<2>& node : cell.nodes()) {
    std::array<uint32_t, 2> name;
    for (int k = 0; k < 2; ++k) {
      const Plane<2>& plane = cell.plane(node.planes[k]);
      name[k] = plane.kind == PlaneKind::kBisector ? Index(plane.vertex) : 1'000'000u + plane.face;
    }
    names.push_back(name);
  }
  std::rotate(names.begin(), std::min_element(names.begin(), names.end()), names.end());
  return names;
}

class PolygonTest : public test::SeededTest {
 protected:
  PolygonTest() : SeededTest(1850) {}
};

TEST_F(PolygonTest, VerticesAtOnceCutAsOneByOneWithEveryUnit) {
  int tied = 0;
  for (int i = 0; i < 400; ++i) {
    const int bits = i % 2 == 0 ? 3 : 20;
    // Where ties are kept, nodes in the same place depend on the order.
    const TieRule rule = i % 4 == 1 ? TieRule::kKeep : TieRule::kPerturb;
    const std::vector<Point<2>> points = DrawPoints(2 + random_.Below(bits == 3 ? 50 : 150), bits, random_);
    Polygon expected;
    Begin(points, bits, rule, expected);
    for (uint32_t u = 1; u < points.size(); ++u) {
      expected.Cut(VertexId{u}, points[u]);
    }
    const auto names = NamesAround(expected);
    tied += expected.counters().exact > 0 ? 1 : 0;
    for (const VectorUnit unit : Units()) {
      for (const size_t together : {size_t{5}, size_t{48}, Polygon::kMostPositions}) {
        Polygon cell(unit);
        Begin(points, bits, rule, cell);
        CutByAll(points, together, cell);
        ASSERT_EQ(NamesAround(cell), names);
        for (size_t n = 0; n < cell.nodes().size(); ++n) {
          const auto same = std::find_if(expected.nodes().begin(), expected.nodes().end(),
                                         [&](const CellNode<2>& node) { return node.x == cell.nodes()[n].x; });
          ASSERT_NE(same, expected.nodes().end()) << "a node that depends on the order of the cuts";
        }
      }
    }
  }
  EXPECT_GT(tied, 100);
}

TEST_F(PolygonTest, EveryUnitTellsTheSame) {
  if (!Has(VectorUnit::kAvx2)) {
    GTEST_SKIP() << "this processor has one unit";
  }
  int kept = 0;
  int reached = 0;
  for (int i = 0; i < 300; ++i) {
    const std::vector<Point<2>> points = DrawPoints(60, 20, random_);
    Polygon baseline(VectorUnit::kBaseline);
    Polygon wide(VectorUnit::kAvx2);
    for (Polygon* cell : {&baseline, &wide}) {
      Begin(points, 20, TieRule::kPerturb, *cell);
      CutByAll(points, 48, *cell);
    }
    ASSERT_EQ(baseline.reach_sq(), wide.reach_sq());
    ASSERT_EQ(baseline.cuts(), wide.cuts());
    for (double ratio = 0.5; ratio < 4; ratio *= 1.1) {
      ASSERT_EQ(baseline.KeepsRatio(ratio), wide.KeepsRatio(ratio));
      kept += wide.KeepsRatio(ratio) ? 1 : 0;
    }
    for (int j = 0; j < 20; ++j) {
      const Point<2> low = DrawPoints(1, 20, random_)[0];
      const Box<2> cube = {low, {low[0] + 1000, low[1] + 1000}};
      ASSERT_EQ(baseline.Reaches(cube), wide.Reaches(cube));
      reached += wide.Reaches(cube) ? 1 : 0;
    }
  }
  EXPECT_GT(kept, 0);
  EXPECT_GT(reached, 0);
}

// A polygon of more nodes than one vector holds, and one that has them no more.
TEST_F(PolygonTest, ManyNodesComeAndGo) {
  for (const VectorUnit unit : Units()) {
    for (const uint32_t count : {7u, 8u, 9u, 10u, 17u, 300u}) {
      Polygon cell(unit);
      cell.Reset({0, 0}, {{-4, -4}, {4, 4}}, kFaces, TieRule::kPerturb);
      for (uint32_t u = 1; u <= count; ++u) {
        const double angle = 2 * std::numbers::pi * u / count;
        EXPECT_TRUE(cell.Cut(VertexId{u}, {std::cos(angle), std::sin(angle)}));
      }
      EXPECT_EQ(cell.nodes().size(), count);
      EXPECT_NEAR(std::sqrt(cell.reach_sq()), 0.5 / std::cos(std::numbers::pi / count), 1e-6);
      EXPECT_TRUE(cell.Reaches({{0.9, 0}, {1.1, 0.1}}));
      EXPECT_FALSE(cell.Reaches({{1.5, 1.5}, {1.6, 1.6}}));
      const double ratio = 0.5 / std::cos(std::numbers::pi / count);
      EXPECT_TRUE(cell.KeepsRatio(ratio * 1.001));
      EXPECT_FALSE(cell.KeepsRatio(ratio * 0.999));
      Star<2> star;
      cell.FindStar(star);
      EXPECT_EQ(star.size(), count);
      // A triangle about the site is left.
      for (uint32_t k = 0; k < 3; ++k) {
        const double angle = 2 * std::numbers::pi * (k + 0.1) / 3;
        EXPECT_TRUE(cell.Cut(VertexId{count + 1 + k}, {0.3 * std::cos(angle), 0.3 * std::sin(angle)}));
      }
      EXPECT_EQ(cell.nodes().size(), 3u);
      EXPECT_NEAR(cell.reach_sq(), 0.09, 1e-6);
    }
  }
}

// Far below what floats can tell from the site, all is decided exactly.
TEST_F(PolygonTest, VerticesMayBeVeryNear) {
  for (const VectorUnit unit : Units()) {
    for (const double near : {1e-20, 1e-60, 1e-100}) {
      std::vector<Point<2>> points = {{0, 0}, {near, 0}, {0, near}, {-near, -near}, {1, 1}};
      Polygon cell(unit);
      cell.Reset(points[0], {{-4, -4}, {4, 4}}, kFaces, TieRule::kPerturb);
      CutByAll(points, points.size(), cell);
      const auto names = NamesAround(cell);
      EXPECT_EQ(names, (std::vector<std::array<uint32_t, 2>>{{1, 2}, {2, 3}, {1, 3}})) << near;
      const std::array<Point<2>, 3> expected = {{{0.5, 0.5}, {-1.5, 0.5}, {0.5, -1.5}}};
      for (const CellNode<2>& node : cell.nodes()) {
        EXPECT_TRUE(std::any_of(expected.begin(), expected.end(), [&](const Point<2>& x) {
          return std::abs(node.x[0] / near - x[0]) < 1e-12 && std::abs(node.x[1] / near - x[1]) < 1e-12;
        })) << near;
      }
    }
  }
}

TEST_F(PolygonTest, UnitsOfLengthDoNotMatter) {
  for (int i = 0; i < 50; ++i) {
    std::vector<Point<2>> points = DrawPoints(40, 10, random_);
    Polygon cell;
    Begin(points, 10, TieRule::kPerturb, cell);
    CutByAll(points, 48, cell);
    const auto names = NamesAround(cell);
    for (const int exponent : {-300, -10, 300}) {
      std::vector<Point<2>> scaled = points;
      for (Point<2>& p : scaled) {
        p = {std::ldexp(p[0], exponent), std::ldexp(p[1], exponent)};
      }
      const double side = std::ldexp(1024.0, exponent);
      const double low = std::ldexp(-1.0, exponent);
      cell.Reset(scaled[0], {{low, low}, {side, side}}, kFaces, TieRule::kPerturb);
      CutByAll(scaled, 48, cell);
      ASSERT_EQ(NamesAround(cell), names) << "units of 2^" << exponent;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
