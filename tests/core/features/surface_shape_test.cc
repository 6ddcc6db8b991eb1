// The shape of a complex as a whole: open loops, branchings, flipped triangles, sharpness.
#include "core/features/surface_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

SurfaceComplex ComplexOf(const test::TestSurface& surface) {
  const SurfaceFeatures features = surface.Features();
  return *MakeSurfaceComplex(surface.points, {}, features, RunContext());
}

SurfaceShape ShapeOf(const test::TestSurface& surface) {
  const auto shape = DescribeShape(ComplexOf(surface), RunContext());
  EXPECT_TRUE(shape.ok()) << shape.status();
  return *shape;
}

// Without the triangles that are named.
test::TestSurface Without(const test::TestSurface& surface, const std::vector<size_t>& gone) {
  test::TestSurface left;
  left.points = surface.points;
  for (size_t t = 0; t < surface.triangle_count(); ++t) {
    if (std::find(gone.begin(), gone.end(), t) == gone.end()) {
      left.AddTriangle({surface.corners[3 * t], surface.corners[3 * t + 1], surface.corners[3 * t + 2]},
                       surface.markers[t]);
    }
  }
  return left;
}

class SurfaceShapeTest : public test::SeededTest {
 protected:
  SurfaceShapeTest() : SeededTest(20'546) {}
};

TEST_F(SurfaceShapeTest, ACubeIsClosedAndRightAngled) {
  const SurfaceShape shape = ShapeOf(test::Cube());
  EXPECT_EQ(shape.components, 1u);
  EXPECT_EQ(shape.open_edges, 0u);
  EXPECT_TRUE(shape.loops.empty());
  EXPECT_EQ(shape.branching_edges, 0u);
  EXPECT_EQ(shape.flipped_triangles, 0u);
  EXPECT_DOUBLE_EQ(shape.area, 6);
  EXPECT_NEAR(shape.sharpest_angle, 90, 1e-12);
}

TEST_F(SurfaceShapeTest, AMissingTriangleIsALoopWithItsPlaceAndLength) {
  const test::TestSurface cube = test::Cube();
  for (size_t t = 0; t < 12; ++t) {
    const SurfaceShape shape = ShapeOf(Without(cube, {t}));
    EXPECT_EQ(shape.open_edges, 3u);
    ASSERT_EQ(shape.loops.size(), 1u);
    EXPECT_TRUE(shape.loops[0].is_closed);
    EXPECT_EQ(shape.loops[0].edges, 3u);
    EXPECT_DOUBLE_EQ(shape.loops[0].length, 2 + std::numbers::sqrt2);
    // The middle of a side of the cube.
    double off = 0;
    for (const double x : shape.loops[0].at) {
      off += std::abs(x - 0.5);
    }
    EXPECT_DOUBLE_EQ(off, 0.5);
  }
}

TEST_F(SurfaceShapeTest, HolesThatTouchInAPointAreTwoLoops) {
  const test::TestSurface sphere = test::Sphere(3);
  // Two triangles at point 0 that have no other point in common.
  std::vector<size_t> gone;
  for (size_t t = 0; t < sphere.triangle_count() && gone.size() < 2; ++t) {
    const auto has = [&](size_t of, uint32_t point) {
      return sphere.corners[3 * of] == point || sphere.corners[3 * of + 1] == point ||
             sphere.corners[3 * of + 2] == point;
    };
    size_t common = 0;
    for (size_t k = 0; k < 3 && !gone.empty(); ++k) {
      common += has(gone[0], sphere.corners[3 * t + k]) ? 1 : 0;
    }
    if (has(t, 0) && common <= 1) {
      gone.push_back(t);
    }
  }
  ASSERT_EQ(gone.size(), 2u);
  const SurfaceShape shape = ShapeOf(Without(sphere, gone));
  EXPECT_EQ(shape.open_edges, 6u);
  ASSERT_EQ(shape.loops.size(), 2u);
  EXPECT_GE(shape.loops[0].length, shape.loops[1].length);
}

TEST_F(SurfaceShapeTest, LoopsAreSortedByLength) {
  test::TestSurface surface;
  for (int i = 1; i <= 5; ++i) {
    const double size = i;
    surface.AddPolygon({{10.0 * i, 0, 0}, {10.0 * i + size, 0, 0}, {10.0 * i, size, 0}});
  }
  const SurfaceShape shape = ShapeOf(test::Shuffled(surface, random_));
  ASSERT_EQ(shape.loops.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    EXPECT_DOUBLE_EQ(shape.loops[i].length, (5 - i) * (2 + std::numbers::sqrt2));
  }
}

TEST_F(SurfaceShapeTest, AWallThatEndsInsideIsAnOpenWayBetweenBranchings) {
  const test::TestSurface wall = test::SevenComplexes()[6].surface;
  const SurfaceShape shape = ShapeOf(wall);
  EXPECT_EQ(shape.open_edges, 1u);
  ASSERT_EQ(shape.loops.size(), 1u);
  EXPECT_FALSE(shape.loops[0].is_closed);
  EXPECT_EQ(shape.branching_edges, 3u);
  EXPECT_EQ(shape.odd_edges.size(), 3u);
}

TEST_F(SurfaceShapeTest, CheckersTouchInEdgesOfFour) {
  const SurfaceShape shape = ShapeOf(test::SevenComplexes()[4].surface);
  EXPECT_EQ(shape.branching_edges, 6u);
  EXPECT_TRUE(shape.odd_edges.empty());
  EXPECT_NEAR(shape.sharpest_angle, 90, 1e-12);
}

TEST_F(SurfaceShapeTest, FewerThanHalfAreFlipped) {
  const test::TestSurface sphere = test::Sphere(3);
  for (const uint64_t count : {1u, 10u, 600u, 1279u}) {
    test::TestSurface turned = sphere;
    for (uint64_t t = 0; t < count; ++t) {
      std::swap(turned.corners[3 * t], turned.corners[3 * t + 1]);
    }
    EXPECT_EQ(ShapeOf(turned).flipped_triangles, std::min<uint64_t>(count, 1280 - count));
    EXPECT_EQ(ShapeOf(turned).one_sided, 0u);
  }
}

TEST_F(SurfaceShapeTest, TheFirstFlippedTriangleIsOfThem) {
  test::TestSurface turned = test::Sphere(3);
  std::swap(turned.corners[300], turned.corners[301]);
  const SurfaceComplex complex = ComplexOf(turned);
  const auto shape = DescribeShape(complex, RunContext());
  ASSERT_TRUE(shape.ok());
  EXPECT_EQ(shape->flipped_triangles, 1u);
  EXPECT_EQ(complex.sources[shape->first_flipped], 100u);
}

TEST_F(SurfaceShapeTest, AMoebiusStripHasOneSide) {
  test::TestSurface strip;
  constexpr uint32_t kCount = 24;
  for (uint32_t i = 0; i < kCount; ++i) {
    const double along = 2 * std::numbers::pi * i / kCount;
    for (const double across : {-0.2, 0.2}) {
      const double reach = 1 + across * std::cos(0.5 * along);
      strip.AddPoint({reach * std::cos(along), reach * std::sin(along), across * std::sin(0.5 * along)});
    }
  }
  for (uint32_t i = 0; i < kCount; ++i) {
    const bool is_last = i + 1 == kCount;
    const uint32_t low = is_last ? 1 : 2 * i + 2;
    const uint32_t high = is_last ? 0 : 2 * i + 3;
    strip.AddTriangle({2 * i, low, high});
    strip.AddTriangle({2 * i, high, 2 * i + 1});
  }
  const SurfaceShape shape = ShapeOf(strip);
  EXPECT_EQ(shape.one_sided, 1u);
  EXPECT_EQ(shape.flipped_triangles, 0u);
  EXPECT_EQ(shape.loops.size(), 1u);
  EXPECT_EQ(shape.loops[0].edges, 2 * kCount);
}

TEST_F(SurfaceShapeTest, TheSharpestAngleIsBetweenNeighbours) {
  for (const double degrees : {170.0, 90.0, 20.0, 1.0}) {
    const double angle = degrees * std::numbers::pi / 180;
    test::TestSurface pages;
    pages.AddPoint({0, 0, 0});
    pages.AddPoint({0, 0, 1});
    for (const double turn : {0.0, angle, angle + 0.5 * (2 * std::numbers::pi - angle)}) {
      pages.AddTriangle({0, 1, pages.AddPoint({std::cos(turn), std::sin(turn), 0.25})});
    }
    EXPECT_NEAR(ShapeOf(pages).sharpest_angle, std::min(degrees, 180 - 0.5 * degrees), 1e-9);
  }
}

TEST_F(SurfaceShapeTest, NoOrderChangesABit) {
  test::TestSurface surface = Without(test::Sphere(4), {3, 4, 5, 100, 700});
  for (double& x : surface.points) {
    x += 0.001 * random_.Gauss();
  }
  surface = test::Joined(surface, test::SevenComplexes()[6].surface);
  const SurfaceShape shape = ShapeOf(surface);
  for (int round = 0; round < 3; ++round) {
    const SurfaceShape other = ShapeOf(test::Shuffled(surface, random_));
    EXPECT_EQ(other.area, shape.area);
    EXPECT_EQ(other.sharpest_angle, shape.sharpest_angle);
    EXPECT_EQ(other.sharpest_edge, shape.sharpest_edge);
    EXPECT_EQ(other.odd_edges, shape.odd_edges);
    ASSERT_EQ(other.loops.size(), shape.loops.size());
    for (size_t i = 0; i < shape.loops.size(); ++i) {
      EXPECT_EQ(other.loops[i].length, shape.loops[i].length);
      EXPECT_EQ(other.loops[i].at, shape.loops[i].at);
      EXPECT_EQ(other.loops[i].first, shape.loops[i].first);
    }
  }
}

}  // namespace
}  // namespace wellspace::core
