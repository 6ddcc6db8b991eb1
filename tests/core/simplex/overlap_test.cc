// How much of a simplex lies in another one, against integrals that are known.
#include "core/simplex/overlap.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"
#include "tests/support/clouds.h"
#include "tests/support/meshes.h"

namespace wellspace::core {
namespace {

template <int D>
Simplex<D> SimplexOf(const test::TestMesh& mesh, size_t simplex) {
  Simplex<D> corners;
  for (int i = 0; i <= D; ++i) {
    corners[i] = PointAt<D>(mesh.points, mesh.simplices[simplex * (D + 1) + i]);
  }
  return corners;
}

template <int D>
Simplex<D> RandomSimplex(test::SplitMix64& random, double size) {
  while (true) {
    Simplex<D> corners;
    for (Point<D>& corner : corners) {
      for (double& x : corner) {
        x = 1.5 + size * (random.Unit() - 0.5);
      }
    }
    if (Orientation<D>(corners).sign == Sign::kPositive) {
      return corners;
    }
  }
}

template <int D>
void ExpectPartsOfGridsAddUp(double tolerance) {
  test::SplitMix64 random(3);
  const test::TestMesh grid = test::KuhnGrid(D, 3);
  for (int i = 0; i < 200; ++i) {
    Simplex<D> simplex = RandomSimplex<D>(random, i % 3 == 0 ? 0.3 : 2.9);
    if (i % 2 == 1) {  // a flat one
      for (int axis = 0; axis < D; ++axis) {
        simplex[D][axis] = simplex[0][axis] / 2 + simplex[1][axis] / 2 + 1e-7 * (simplex[D][axis] - 1.5);
      }
      if (Orientation<D>(simplex).sign != Sign::kPositive) {
        continue;
      }
    }
    double sum = 0;
    for (size_t t = 0; t < grid.SimplexCount(); ++t) {
      const double part = PartInside<D>(simplex, SimplexOf<D>(grid, t));
      EXPECT_GE(part, 0);
      EXPECT_LE(part, 1);
      sum += part;
    }
    EXPECT_NEAR(sum, 1, tolerance) << i;
  }
}

TEST(Overlap, PartsOfAFillingAddUpToOne) {
  ExpectPartsOfGridsAddUp<2>(1e-14);
  ExpectPartsOfGridsAddUp<3>(1e-13);
}

template <int D>
void ExpectBothWaysAlike() {
  test::SplitMix64 random(9);
  int overlapping = 0;
  for (int i = 0; i < 2000; ++i) {
    const Simplex<D> a = RandomSimplex<D>(random, 1);
    const Simplex<D> b = RandomSimplex<D>(random, 1);
    const auto volume = [](const Simplex<D>& s) {
      double sum = 0;
      if constexpr (D == 2) {
        sum = (s[1][0] - s[0][0]) * (s[2][1] - s[0][1]) - (s[1][1] - s[0][1]) * (s[2][0] - s[0][0]);
      } else {
        const Point<D> u = Difference<D>(s[1], s[0]);
        const Point<D> v = Difference<D>(s[2], s[0]);
        const Point<D> w = Difference<D>(s[3], s[0]);
        sum = u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
              u[2] * (v[0] * w[1] - v[1] * w[0]);
      }
      return sum;
    };
    const double of_a = PartInside<D>(a, b) * volume(a);
    EXPECT_NEAR(of_a, PartInside<D>(b, a) * volume(b), 1e-14);
    overlapping += of_a > 0 ? 1 : 0;
  }
  EXPECT_GT(overlapping, 500);
}

TEST(Overlap, TheIntersectionIsTheSameBothWays) {
  ExpectBothWaysAlike<2>();
  ExpectBothWaysAlike<3>();
}

TEST(Overlap, KnownParts) {
  const Simplex<2> unit = {{{0, 0}, {1, 0}, {0, 1}}};
  EXPECT_EQ(PartInside<2>(unit, unit), 1);
  EXPECT_EQ(PartInside<2>(unit, {{{-5, -5}, {9, -5}, {-5, 9}}}), 1);
  EXPECT_EQ(PartInside<2>(unit, {{{1, 0}, {1, 1}, {0, 1}}}), 0);  // has an edge in common
  EXPECT_EQ(PartInside<2>(unit, {{{7, 0}, {8, 1}, {7, 1}}}), 0);
  EXPECT_NEAR(PartInside<2>(unit, {{{0, 0}, {0.5, 0}, {0, 0.5}}}), 0.25, 1e-16);
  EXPECT_NEAR(PartInside<2>(unit, {{{0, 0}, {2, 0}, {2, 2}}}), 0.5, 1e-16);
  const Simplex<3> corner = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  EXPECT_EQ(PartInside<3>(corner, corner), 1);
  EXPECT_NEAR(PartInside<3>(corner, {{{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}}}), 0.125, 1e-16);
  EXPECT_EQ(PartInside<3>(corner, {{{1, 0, 0}, {1, 1, 1}, {0, 1, 0}, {0, 0, 1}}}), 0);  // has a facet in common
}

TEST(Overlap, CoordinatesOfEveryExponent) {
  const Simplex<3> a = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const Simplex<3> b = {{{0.25, 0.25, 0.25}, {1.25, 0.25, 0.25}, {0.25, 1.25, 0.25}, {0.25, 0.25, 1.25}}};
  const double expected = PartInside<3>(a, b);
  EXPECT_NEAR(expected, std::pow(0.25, 3), 1e-15);
  for (int exponent = -1060; exponent < 1023; exponent += 7) {
    Simplex<3> scaled_a = a;
    Simplex<3> scaled_b = b;
    for (int i = 0; i < 4; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        scaled_a[i][axis] = std::ldexp(a[i][axis], exponent);
        scaled_b[i][axis] = std::ldexp(b[i][axis], exponent);
      }
    }
    ASSERT_NEAR(PartInside<3>(scaled_a, scaled_b), expected, 1e-15) << exponent;
  }
}

}  // namespace
}  // namespace wellspace::core
