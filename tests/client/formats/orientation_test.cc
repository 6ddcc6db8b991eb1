// The sign of a simplex, also where rounding would decide it.
#include "client/formats/orientation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace wellspace::formats {
namespace {

// Swaps two corners, which changes the sign.
std::vector<double> Swapped(std::vector<double> corners, size_t dimension) {
  std::swap_ranges(corners.begin(), corners.begin() + dimension, corners.begin() + dimension);
  return corners;
}

TEST(OrientationTest, OfUnitSimplices) {
  EXPECT_EQ(OrientationSign(std::vector<double>{0, 0, 1, 0, 0, 1}), 1);
  EXPECT_EQ(OrientationSign(std::vector<double>{0, 0, 0, 1, 1, 0}), -1);
  EXPECT_EQ(OrientationSign(std::vector<double>{0, 0, 1, 1, 2, 2}), 0);
  EXPECT_EQ(OrientationSign(std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}), 0);
  const std::vector<double> tetrahedron = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  EXPECT_NE(OrientationSign(tetrahedron), 0);
  EXPECT_EQ(OrientationSign(tetrahedron), -OrientationSign(Swapped(tetrahedron, 3)));
}

// A point on a line, and its neighbours one unit in the last place beside it: doubles alone tell none of them apart.
TEST(OrientationTest, OneUnitInTheLastPlaceDecides) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> coordinate(0.5, 1);
  for (const double scale : {1.0, 1e-150, 1e150}) {
    for (int i = 0; i < 300; ++i) {
      const double x = std::ldexp(std::floor(std::ldexp(coordinate(random), 20)), -20);
      const double up = std::nextafter(x * scale, std::numeric_limits<double>::infinity());
      EXPECT_EQ(OrientationSign(std::vector<double>{0, 0, scale, scale, x * scale, x * scale}), 0);
      EXPECT_EQ(OrientationSign(std::vector<double>{0, 0, scale, scale, x * scale, up}), 1);
      EXPECT_EQ(OrientationSign(std::vector<double>{0, 0, scale, scale, up, x * scale}), -1);
      const std::vector<double> flat = {0, 0, 0, scale, 0, scale, 0, scale, scale, x * scale, x * scale, 2 * x * scale};
      std::vector<double> raised = flat;
      raised[11] = std::nextafter(raised[11], std::numeric_limits<double>::infinity());
      EXPECT_EQ(OrientationSign(flat), 0);
      EXPECT_NE(OrientationSign(raised), 0);
      EXPECT_EQ(OrientationSign(raised), -OrientationSign(Swapped(raised, 3)));
    }
  }
}

}  // namespace
}  // namespace wellspace::formats
