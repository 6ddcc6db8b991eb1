// Triangles in space: nearest points against sampled ones, and boxes that are missed.
#include "core/geometry/triangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

class TriangleTest : public test::SeededTest {
 protected:
  TriangleTest() : SeededTest(71'204) {}

  Point<3> RandomPoint() { return {random_.Unit(), random_.Unit(), random_.Unit()}; }

  // No needle, of which the foot of a point is rounded by more.
  Triangle WideTriangle() {
    while (true) {
      const Triangle triangle = {RandomPoint(), RandomPoint(), RandomPoint()};
      if (NormSq<3>(Cross(Difference<3>(triangle[1], triangle[0]), Difference<3>(triangle[2], triangle[0]))) > 1e-4) {
        return triangle;
      }
    }
  }

  Point<3> PointOf(const Triangle& triangle) {
    double u = random_.Unit();
    double v = random_.Unit();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    Point<3> p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] =
          triangle[0][axis] + u * (triangle[1][axis] - triangle[0][axis]) + v * (triangle[2][axis] - triangle[0][axis]);
    }
    return p;
  }
};

TEST_F(TriangleTest, NoSampleIsNearerThanTheNearestPoint) {
  for (int round = 0; round < 500; ++round) {
    const Triangle triangle = WideTriangle();
    const Point<3> p = RandomPoint();
    const Point<3> nearest = NearestPoint(triangle, p);
    double least = Distance<3>(p, triangle[0]);
    for (int i = 0; i < 200; ++i) {
      least = std::min(least, Distance<3>(p, PointOf(triangle)));
    }
    EXPECT_LE(Distance<3>(p, nearest), least + 1e-12);
    // It is a point of the triangle: its own nearest point.
    EXPECT_LE(Distance<3>(nearest, NearestPoint(triangle, nearest)), 1e-12);
  }
}

TEST_F(TriangleTest, PointsOfATriangleAreTheirOwnNearest) {
  for (int round = 0; round < 500; ++round) {
    const Triangle triangle = WideTriangle();
    for (const Point<3>& corner : triangle) {
      EXPECT_EQ(NearestPoint(triangle, corner), corner);
    }
    const Point<3> p = PointOf(triangle);
    EXPECT_LE(Distance<3>(p, NearestPoint(triangle, p)), 1e-12);
  }
}

TEST_F(TriangleTest, BoxesWithAPointOfATriangleAreNotMissed) {
  for (int round = 0; round < 5000; ++round) {
    const Triangle triangle = {RandomPoint(), RandomPoint(), RandomPoint()};
    // A box that has a point of it, be it in a corner.
    const Point<3> p = PointOf(triangle);
    Box<3> box{p, p};
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] -= random_.Below(2) == 0 ? 0.1 * random_.Unit() : 0;
      box.high[axis] += random_.Below(2) == 0 ? 0.1 * random_.Unit() : 0;
    }
    EXPECT_FALSE(SurelyMisses(triangle, box));
    const Point<3> middle = PointOf({triangle[0], triangle[1], triangle[1]});
    EXPECT_FALSE(SurelyMisses(triangle[0], triangle[1], Box<3>{middle, middle}));
  }
}

TEST_F(TriangleTest, BoxesWithACornerOfANeedleAreNotMissed) {
  // Planes of needles are turned by rounding.
  for (int round = 0; round < 20000; ++round) {
    const double width = std::pow(10.0, -3 - 12 * random_.Unit());
    const double share = random_.Unit();
    Triangle triangle = {RandomPoint(), RandomPoint(), {}};
    for (int axis = 0; axis < 3; ++axis) {
      triangle[2][axis] = triangle[0][axis] + share * (triangle[1][axis] - triangle[0][axis]) + width * random_.Unit();
    }
    const Point<3>& p = triangle[random_.Below(3)];
    Box<3> box{p, p};
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] -= random_.Below(2) == 0 ? 1e-3 * random_.Unit() : 0;
      box.high[axis] += random_.Below(2) == 0 ? 1e-3 * random_.Unit() : 0;
    }
    EXPECT_FALSE(SurelyMisses(triangle, box));
    EXPECT_FALSE(SurelyMissesByPlanes(triangle, box));
  }
}

TEST_F(TriangleTest, BoxesThatAreFartherThanRoundingAreMissed) {
  for (int round = 0; round < 5000; ++round) {
    const Triangle triangle = {RandomPoint(), RandomPoint(), RandomPoint()};
    const Point<3> centre = RandomPoint();
    const double half = 0.05 * random_.Unit();
    // By more than half the box's diagonal, so that the box has no point of the triangle.
    const double distance = Distance<3>(centre, NearestPoint(triangle, centre));
    if (distance > 1.733 * half) {
      EXPECT_TRUE(SurelyMisses(triangle, CubeAround<3>(centre, half)));
    }
    const Triangle edge = {triangle[0], triangle[1], triangle[1]};
    if (Distance<3>(centre, NearestPoint(edge, centre)) > 1.733 * half) {
      EXPECT_TRUE(SurelyMisses(triangle[0], triangle[1], CubeAround<3>(centre, half)));
    }
  }
}

}  // namespace
}  // namespace wellspace::core
