// Curves, corners and patches: of parts whose counts are known, with fragments of creases, and in any order.
#include "core/features/surface_curves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/acute_parts.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;

constexpr double kCrease = 30;

struct Found {
  SurfaceComplex complex;
  SurfaceCurves curves;

  std::array<size_t, 3> Counts() const { return {curves.curve_count(), curves.corners.size(), curves.patch_count}; }
};

Found Find(const test::TestSurface& surface, double crease_angle = kCrease, double min_patch = 0) {
  const SurfaceFeatures features = surface.Features();
  const RunContext context;
  Found found;
  found.complex = *MakeSurfaceComplex(surface.points, {}, features, context);
  found.curves = *FindCurves(found.complex, crease_angle, min_patch, context);
  return found;
}

// A disc with a rim that is bent up, of `sides` sides: a cup. The wall has `rows` rows.
test::TestSurface Cup(int sides, double wall) {
  test::TestSurface cup;
  const uint32_t middle = cup.AddPoint({0, 0, 0});
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    cup.AddPoint({std::cos(angle), std::sin(angle), 0});
    cup.AddPoint({std::cos(angle), std::sin(angle), wall});
  }
  for (uint32_t i = 0; i < static_cast<uint32_t>(sides); ++i) {
    const uint32_t a = 1 + 2 * i;
    const uint32_t b = 1 + 2 * ((i + 1) % static_cast<uint32_t>(sides));
    cup.AddTriangle({middle, b, a});
    cup.AddTriangle({a, b, b + 1});
    cup.AddTriangle({a, b + 1, a + 1});
  }
  return cup;
}

TEST(SurfaceCurvesTest, KnownParts) {
  EXPECT_THAT(Find(test::Cube()).Counts(), ElementsAre(12, 8, 6));
  EXPECT_THAT(Find(test::Sphere(2)).Counts(), ElementsAre(0, 0, 1));
  const std::vector<std::array<size_t, 3>> expected = {{20, 12, 11}, {24, 16, 12}, {28, 16, 16}, {36, 20, 21},
                                                       {42, 23, 24}, {16, 12, 7},  {18, 12, 8}};
  // Markers on each side of the two cubes: the row of the reference has them.
  const std::vector<test::NamedComplex> all = test::SevenComplexes();
  for (size_t i = 1; i < all.size(); ++i) {
    EXPECT_EQ(Find(all[i].surface).Counts(), expected[i]) << all[i].name;
  }
}

TEST(SurfaceCurvesTest, ALoopBeginsInItsLowestPoint) {
  const Found found = Find(Cup(48, 1));
  EXPECT_THAT(found.Counts(), ElementsAre(2, 0, 2));  // its rim and its foot
  for (size_t curve = 0; curve < 2; ++curve) {
    const auto points = found.curves.PointsOf(curve);
    ASSERT_EQ(points.size(), 49u);
    EXPECT_EQ(points.front(), points.back());
    EXPECT_EQ(points.front(), *std::min_element(points.begin(), points.end()));
    EXPECT_LT(points[1], points[47]);
  }
}

TEST(SurfaceCurvesTest, ACurveLeadsFromItsLowerCorner) {
  const Found found = Find(test::Subdivided(test::Cube()));
  ASSERT_THAT(found.Counts(), ElementsAre(12, 8, 6));
  for (size_t curve = 0; curve < 12; ++curve) {
    const auto points = found.curves.PointsOf(curve);
    ASSERT_EQ(points.size(), 3u);
    EXPECT_LT(points.front(), points.back());
    EXPECT_TRUE(std::binary_search(found.curves.corners.begin(), found.curves.corners.end(), points.front()));
    EXPECT_TRUE(std::binary_search(found.curves.corners.begin(), found.curves.corners.end(), points.back()));
  }
}

TEST(SurfaceCurvesTest, ATurnIsACorner) {
  // Around eight sides a rim turns by 45 degrees at each point, around twelve by 30.
  EXPECT_THAT(Find(Cup(8, 1)).Counts(), ElementsAre(24, 16, 9));
  EXPECT_THAT(Find(Cup(13, 1)).Counts(), ElementsAre(2, 0, 2));
}

TEST(SurfaceCurvesTest, OtherPatchesAroundMakeACorner) {
  test::TestSurface cup = Cup(48, 1);
  for (size_t t = 0; t < cup.triangle_count(); ++t) {
    cup.markers[t] = t % 3 == 0 ? 0 : t < 72 ? 1 : 2;  // two parts of the wall
  }
  // Rim and foot are parted in two places each, which the walls' common sides join.
  EXPECT_THAT(Find(cup).Counts(), ElementsAre(6, 4, 3));
}

TEST(SurfaceCurvesTest, TheTipOfAConeIsACorner) {
  test::TestSurface cone = Cup(48, 1);
  cone.points[2] = -1;  // 255 degrees around the middle
  EXPECT_THAT(Find(cone, 50).Counts(), ElementsAre(1, 1, 1));
  cone.points[2] = -0.5;  // 322
  EXPECT_THAT(Find(cone, 80).Counts(), ElementsAre(1, 0, 1));
}

// A flat square, with a small triangle in it whose corner is raised so that it and its neighbours are creased.
test::TestSurface Bump(double height) {
  test::TestSurface s;
  constexpr int kCount = 20;
  for (int i = 0; i <= kCount; ++i) {
    for (int j = 0; j <= kCount; ++j) {
      s.AddPoint({0.05 * i, 0.05 * j, i == 10 && j == 10 ? height : 0.0});
    }
  }
  for (uint32_t i = 0; i < kCount; ++i) {
    for (uint32_t j = 0; j < kCount; ++j) {
      const uint32_t a = i * (kCount + 1) + j;
      s.AddTriangle({a, a + kCount + 1, a + kCount + 2});
      s.AddTriangle({a, a + kCount + 2, a + 1});
    }
  }
  return s;
}

TEST(SurfaceCurvesTest, SmallPatchesJoinAcrossWeakCreases) {
  const test::TestSurface bump = Bump(0.02);
  EXPECT_GT(Find(bump, 15).curves.patch_count, 2u);
  EXPECT_THAT(Find(bump, 15, 0.2).Counts(), ElementsAre(4, 4, 1));  // the border of the square
}

TEST(SurfaceCurvesTest, SmallPatchesStayWhereCreasesAreStrongOrMarkersChange) {
  EXPECT_GT(Find(Bump(0.5), kCrease, 0.2).curves.patch_count, 1u);
  test::TestSurface marked = Bump(0);
  marked.markers[400] = 1;
  EXPECT_EQ(Find(marked, kCrease, 0.2).curves.patch_count, 2u);
}

// The upper side of a wing goes over into the lower one in front; at the back they meet in an edge.
TEST(SurfaceCurvesTest, ALongSharpEdgeStaysThoughOnePatchGoesAround) {
  const test::TestSurface wing = test::Wing(40);
  EXPECT_THAT(Find(wing, kCrease, 0.01).Counts(), ElementsAre(3, 2, 3));
  EXPECT_THAT(Find(wing, kCrease, 1).Counts(), ElementsAre(2, 2, 3));  // an edge shorter than 5 is a fragment then
}

TEST(SurfaceCurvesTest, At180DegreesMarkersAndBordersAloneMakeCurves) {
  EXPECT_THAT(Find(test::Cube(), 180).Counts(), ElementsAre(0, 8, 1));  // a corner has 270 degrees
  EXPECT_THAT(Find(Bump(0.5), 180).Counts(), ElementsAre(4, 5, 1));
}

TEST(SurfaceCurvesTest, CreaseAngleDoesNotDependOnWhichWayTrianglesGo) {
  test::TestSurface one;
  one.AddPolygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  one.AddTriangle({1, 0, one.AddPoint({0, -1, 1})});
  test::TestSurface other = one;
  std::swap(other.corners[3], other.corners[4]);
  for (const test::TestSurface* surface : {&one, &other}) {
    const Found found = Find(*surface);
    for (uint32_t e = 0; e < found.complex.edges.size(); ++e) {
      if (found.complex.SidesAt(e).size() == 2) {
        EXPECT_NEAR(CreaseAngle(found.complex, e), 45, 1e-12);
      }
    }
  }
}

class SurfaceCurvesOrderTest : public test::SeededTest {
 protected:
  SurfaceCurvesOrderTest() : SeededTest(20'542) {}
};

TEST_F(SurfaceCurvesOrderTest, NoOrderChangesABit) {
  // Noise makes creases of chance, which join in many steps.
  test::TestSurface noisy = test::Sphere(4);
  for (double& x : noisy.points) {
    x += 0.01 * random_.Gauss();
  }
  for (const test::TestSurface& surface : {noisy, test::Joined(test::Cube(), Bump(0.035))}) {
    const Found found = Find(surface, kCrease, 0.05);
    EXPECT_GT(found.curves.curve_count(), 0u);
    for (int round = 0; round < 5; ++round) {
      const Found other = Find(test::Shuffled(surface, random_), kCrease, 0.05);
      EXPECT_EQ(other.curves.patch_of, found.curves.patch_of);
      EXPECT_EQ(other.curves.corners, found.curves.corners);
      EXPECT_EQ(other.curves.first_point, found.curves.first_point);
      EXPECT_EQ(other.curves.points, found.curves.points);
    }
  }
}

TEST_F(SurfaceCurvesOrderTest, EdgesBesideTwoPatchesAreOnCurves) {
  test::TestSurface noisy = test::Sphere(3);
  for (double& x : noisy.points) {
    x += 0.03 * random_.Gauss();
  }
  for (const double min_patch : {0.0, 0.1, 0.5, 3.0}) {
    const Found found = Find(noisy, kCrease, min_patch);
    std::vector<std::array<uint32_t, 2>> on_curves;
    for (size_t curve = 0; curve < found.curves.curve_count(); ++curve) {
      const auto points = found.curves.PointsOf(curve);
      for (size_t i = 1; i < points.size(); ++i) {
        on_curves.push_back({std::min(points[i - 1], points[i]), std::max(points[i - 1], points[i])});
      }
    }
    std::sort(on_curves.begin(), on_curves.end());
    EXPECT_EQ(std::adjacent_find(on_curves.begin(), on_curves.end()), on_curves.end());
    std::vector<std::array<uint32_t, 2>> between;
    for (uint32_t e = 0; e < found.complex.edges.size(); ++e) {
      const auto sides = found.complex.SidesAt(e);
      if (found.curves.patch_of[TriangleOf(sides[0])] != found.curves.patch_of[TriangleOf(sides[1])]) {
        between.push_back(found.complex.edges[e]);
      }
    }
    EXPECT_EQ(on_curves, between) << min_patch;
  }
}

}  // namespace
}  // namespace wellspace::core
