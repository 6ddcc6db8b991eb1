// Winding numbers, against the sum over all triangles.
#include "core/features/winding_numbers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/geometry/vector_product.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

SurfaceComplex ComplexOf(const test::TestSurface& surface) {
  absl::StatusOr<SurfaceComplex> complex = MakeSurfaceComplex(surface.points, {}, surface.Features(), RunContext());
  EXPECT_TRUE(complex.ok()) << complex.status();
  return *std::move(complex);
}

WindingNumbers NumbersOf(const SurfaceComplex& complex) {
  WindingNumbers numbers;
  EXPECT_TRUE(numbers.Build(complex, RunContext()).ok());
  return numbers;
}

// The sum of the solid angles, each as the excess of a spherical triangle over its sides: another formula.
double SumAt(const SurfaceComplex& complex, const Point<3>& p) {
  double sum = 0;
  for (uint32_t t = 0; t < complex.triangles.size(); ++t) {
    std::array<Point<3>, 3> unit;
    for (uint32_t k = 0; k < 3; ++k) {
      unit[k] = Difference<3>(complex.Corner(t, k), p);
      const double length = std::sqrt(NormSq<3>(unit[k]));
      for (double& x : unit[k]) {
        x /= length;
      }
    }
    std::array<double, 3> sides;
    double half = 0;
    for (size_t k = 0; k < 3; ++k) {
      sides[k] = AngleBetween(unit[(k + 1) % 3], unit[(k + 2) % 3]) * std::numbers::pi / 180;
      half += 0.5 * sides[k];
    }
    double product = std::tan(half / 2);
    for (const double side : sides) {
      product *= std::tan((half - side) / 2);
    }
    const double sign = Dot<3>(unit[0], Cross(unit[1], unit[2])) < 0 ? -1 : 1;
    sum += sign * 4 * std::atan(std::sqrt(std::max(0.0, product)));
  }
  return sum / (4 * std::numbers::pi);
}

class WindingNumbersTest : public test::SeededTest {
 protected:
  WindingNumbersTest() : SeededTest(20261130) {}

  Point<3> RandomPoint(double reach) {
    Point<3> p;
    for (double& x : p) {
      x = reach * (2 * random_.Unit() - 1);
    }
    return p;
  }
};

TEST_F(WindingNumbersTest, AreTheSumOfSolidAngles) {
  test::TestSurface holed = test::Sphere(4);
  holed.corners.resize(holed.corners.size() * 3 / 4);
  for (const test::TestSurface& surface : {test::Sphere(4), holed, test::SurfaceOf("spot")}) {
    const SurfaceComplex complex = ComplexOf(surface);
    const WindingNumbers numbers = NumbersOf(complex);
    for (int i = 0; i < 200; ++i) {
      const Point<3> p = RandomPoint(1.5);
      const double sum = SumAt(complex, p);
      EXPECT_NEAR(numbers.At(p), sum, std::abs(std::abs(sum) - 0.5) < 0.1 ? 0.005 : 0.05);
    }
  }
}

TEST_F(WindingNumbersTest, AreWholeForClosedSurfaces) {
  const SurfaceComplex sphere = ComplexOf(test::Sphere(4));
  const WindingNumbers numbers = NumbersOf(sphere);
  for (int i = 0; i < 500; ++i) {
    const Point<3> p = RandomPoint(1.2);
    const double radius = std::sqrt(NormSq<3>(p));
    if (std::abs(radius - 1) > 0.01) {
      EXPECT_NEAR(numbers.At(p), radius < 1 ? 1 : 0, 0.05);
    }
  }
}

TEST_F(WindingNumbersTest, CrossingsAreThoseOfAllTriangles) {
  const SurfaceComplex spot = ComplexOf(test::SurfaceOf("spot"));
  const WindingNumbers numbers = NumbersOf(spot);
  std::vector<double> shares;
  size_t met = 0;
  for (int i = 0; i < 300; ++i) {
    const Point<3> a = RandomPoint(1);
    const Point<3> b = RandomPoint(1);
    numbers.FindCrossings(a, b, shares);
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_EQ(shares.size() % 2, (numbers.At(a) > 0.5) != (numbers.At(b) > 0.5) ? 1u : 0u);
    met += shares.size();
  }
  EXPECT_GT(met, 100);
}

TEST_F(WindingNumbersTest, OrderDoesNotChangeABit) {
  const test::TestSurface surface = test::Sphere(3);
  const SurfaceComplex one = ComplexOf(surface);
  const SurfaceComplex other = ComplexOf(test::Shuffled(surface, random_));
  const WindingNumbers numbers = NumbersOf(one);
  const WindingNumbers again = NumbersOf(other);
  for (int i = 0; i < 100; ++i) {
    const Point<3> p = RandomPoint(2);
    EXPECT_EQ(numbers.At(p), again.At(p));
  }
}

}  // namespace
}  // namespace wellspace::core
