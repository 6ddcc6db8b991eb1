// Crossings of segments and triangles against rational arithmetic with points that are moved by very little.
#include "core/features/triangle_crossing.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstddef>
#include <optional>
#include <vector>

#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using RationalPoint = std::array<Rational, 3>;

RationalPoint Unmoved(const Point<3>& p) { return {Rational(p[0]), Rational(p[1]), Rational(p[2])}; }

// By 2^-200 and its powers: less than anything that coordinates of some bits can tell apart.
RationalPoint Moved(const Point<3>& p) {
  const Rational e = Rational(1) / (boost::multiprecision::cpp_int(1) << 200);
  return {Rational(p[0]) + e, Rational(p[1]) + e * e, Rational(p[2]) + e * e * e};
}

Rational Determinant(const RationalPoint& o, const RationalPoint& a, const RationalPoint& b, const RationalPoint& c) {
  std::array<RationalPoint, 3> m;
  for (size_t i = 0; i < 3; ++i) {
    m[0][i] = a[i] - o[i];
    m[1][i] = b[i] - o[i];
    m[2][i] = c[i] - o[i];
  }
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

Sign SignOf(const Rational& x) { return x < 0 ? Sign::kNegative : x > 0 ? Sign::kPositive : Sign::kZero; }

// The place along the segment from p to q where it crosses a triangle, if it does.
std::optional<Rational> CrossedAt(const Triangle& triangle, const Point<3>& p, const Point<3>& q) {
  const RationalPoint a = Unmoved(triangle[0]);
  const RationalPoint b = Unmoved(triangle[1]);
  const RationalPoint c = Unmoved(triangle[2]);
  const RationalPoint from = Moved(p);
  const RationalPoint to = Moved(q);
  const Rational of_p = Determinant(a, b, c, from);
  const Rational of_q = Determinant(a, b, c, to);
  EXPECT_NE(of_p, 0);
  if (SignOf(of_p) == SignOf(of_q)) {
    return std::nullopt;
  }
  const Rational along = of_p / (of_p - of_q);
  RationalPoint at;
  for (size_t i = 0; i < 3; ++i) {
    at[i] = from[i] + along * (to[i] - from[i]);
  }
  // Inside if the point sees all sides from one side; from the tip of a tetrahedron over the triangle.
  const Sign side = SignOf(Determinant(from, a, b, at));
  EXPECT_NE(side, Sign::kZero);
  return SignOf(Determinant(from, b, c, at)) == side && SignOf(Determinant(from, c, a, at)) == side
             ? std::optional(along)
             : std::nullopt;
}

class TriangleCrossingTest : public test::SeededTest {
 protected:
  TriangleCrossingTest() : SeededTest(11'803) {}

  // Of a grid of few points, so that most things that can coincide do.
  Point<3> GridPoint(uint64_t size) {
    return {static_cast<double>(random_.Below(size)), static_cast<double>(random_.Below(size)),
            static_cast<double>(random_.Below(size))};
  }
  Triangle GridTriangle(uint64_t size) {
    while (true) {
      const Triangle triangle = {GridPoint(size), GridPoint(size), GridPoint(size)};
      if (NormSq<3>(Cross(Difference<3>(triangle[1], triangle[0]), Difference<3>(triangle[2], triangle[0]))) > 0) {
        return triangle;
      }
    }
  }
};

TEST_F(TriangleCrossingTest, SidesAreThoseOfMovedPoints) {
  for (int round = 0; round < 2000; ++round) {
    const Triangle triangle = GridTriangle(3);
    const Point<3> p = GridPoint(3);
    EXPECT_EQ(MovedSide(triangle, p),
              SignOf(Determinant(Unmoved(triangle[0]), Unmoved(triangle[1]), Unmoved(triangle[2]), Moved(p))));
    EXPECT_EQ(MovedSide({triangle[1], triangle[0], triangle[2]}, p), -MovedSide(triangle, p));
  }
}

TEST_F(TriangleCrossingTest, CrossingsAreThoseOfMovedSegments) {
  int crossed = 0;
  for (int round = 0; round < 4000; ++round) {
    const uint64_t size = 2 + random_.Below(4);
    const Triangle triangle = GridTriangle(size);
    const Point<3> p = GridPoint(size);
    const Point<3> q = GridPoint(size);
    const bool is_crossed = CrossedAt(triangle, p, q).has_value();
    EXPECT_EQ(Crosses(triangle, p, MovedSide(triangle, p), q, MovedSide(triangle, q)), is_crossed);
    crossed += is_crossed ? 1 : 0;
  }
  EXPECT_GT(crossed, 100);
}

TEST_F(TriangleCrossingTest, TheOrderIsThatAlongMovedSegments) {
  int compared = 0;
  int equal = 0;
  for (int round = 0; round < 40000; ++round) {
    const uint64_t size = 2 + random_.Below(4);
    const Triangle one = GridTriangle(size);
    const Triangle other = GridTriangle(size);
    const Point<3> p = GridPoint(size);
    const Point<3> q = GridPoint(size);
    const bool may_cross = Crosses(one, p, MovedSide(one, p), q, MovedSide(one, q)) &&
                           Crosses(other, p, MovedSide(other, p), q, MovedSide(other, q));
    if (!may_cross) {
      continue;
    }
    const std::optional<Rational> of_one = CrossedAt(one, p, q);
    const std::optional<Rational> of_other = CrossedAt(other, p, q);
    ASSERT_TRUE(of_one.has_value() && of_other.has_value());
    EXPECT_EQ(IsCrossedBefore(one, other, p, q), *of_one < *of_other);
    EXPECT_EQ(IsCrossedBefore(other, one, p, q), *of_other < *of_one);
    ++compared;
    equal += *of_one == *of_other ? 1 : 0;
  }
  EXPECT_GT(compared, 200);
  EXPECT_GT(equal, 0);  // in one plane
}

TEST_F(TriangleCrossingTest, NothingLeaksBetweenTrianglesAroundACorner) {
  // The eight triangles of an octahedron around its middle: whatever leaves crosses one of them, be it through a corner
  // or along a side.
  const std::array<Point<3>, 6> tips = {Point<3>{2, 0, 0},  Point<3>{-2, 0, 0}, Point<3>{0, 2, 0},
                                        Point<3>{0, -2, 0}, Point<3>{0, 0, 2},  Point<3>{0, 0, -2}};
  for (int round = 0; round < 2000; ++round) {
    const Point<3> p = {0, 0, 0};
    Point<3> q = GridPoint(9);
    for (double& x : q) {
      x -= 4;
    }
    if (std::abs(q[0]) + std::abs(q[1]) + std::abs(q[2]) <= 2) {
      continue;
    }
    int crossed = 0;
    for (int octant = 0; octant < 8; ++octant) {
      const Triangle triangle = {tips[octant & 1], tips[2 + ((octant >> 1) & 1)], tips[4 + (octant >> 2)]};
      crossed += Crosses(triangle, p, MovedSide(triangle, p), q, MovedSide(triangle, q)) ? 1 : 0;
    }
    EXPECT_EQ(crossed, 1) << q[0] << " " << q[1] << " " << q[2];
  }
}

TEST_F(TriangleCrossingTest, CoordinatesMayBeTinyOrHuge) {
  for (const double scale : {0x1p-300, 0x1p-60, 1.0, 0x1p60, 0x1p200}) {
    Triangle triangle = {Point<3>{0, 0, 0}, Point<3>{1, 0, 0}, Point<3>{0, 1, 0}};
    for (Point<3>& corner : triangle) {
      for (double& x : corner) {
        x *= scale;
      }
    }
    const Point<3> p = {0, 0, 0};  // on a corner: moved inwards and up
    const Point<3> q = {0, 0, -scale};
    EXPECT_EQ(MovedSide(triangle, p), Sign::kPositive) << scale;
    EXPECT_TRUE(Crosses(triangle, p, MovedSide(triangle, p), q, MovedSide(triangle, q))) << scale;
  }
}

}  // namespace
}  // namespace wellspace::core
