// Degenerate clouds, which the exact stage of the predicates decides, cost no more than three times as many random
// points.
//
// Times are compared within one run, the best of three each: machines are noisy, and this is no benchmark.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

constexpr double kBound = 3;

double BestSeconds(int dimension, const std::vector<double>& cloud) {
  const MeshParameters parameters = test::InUnitBox(dimension);
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    RunContext context;
    const auto begin = std::chrono::steady_clock::now();
    const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud, context);
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    EXPECT_TRUE(mesh.ok()) << mesh.status();
  }
  return best;
}

void ExpectCheap(int dimension, const std::vector<double>& cloud) {
  const std::vector<double> random = test::MakeCloud("uniform", dimension, cloud.size() / dimension);
  const double ratio = BestSeconds(dimension, cloud) / BestSeconds(dimension, random);
  ::testing::Test::RecordProperty("ratio", std::to_string(ratio));
  EXPECT_LE(ratio, kBound);
}

// Points (i + 1/2) / side: their coordinates use all bits, so most decisions are nearly ties, or ties.
std::vector<double> FullBitGrid(int dimension, int side) {
  std::vector<double> cloud;
  const auto count = static_cast<int>(std::lround(std::pow(side, dimension)));
  for (int i = 0; i < count; ++i) {
    for (int k = 0, rest = i; k < dimension; ++k, rest /= side) {
      cloud.push_back((rest % side + 0.5) / side);
    }
  }
  return cloud;
}

// Integer points at exactly one distance from the centre: x^2 + y^2 + z^2 = N has 114 720 solutions.
std::vector<double> LatticeSphere() {
  constexpr int64_t kSquaredRadius = 130'000'013;
  constexpr double kUnit = 0x1p-15;
  std::vector<double> cloud;
  const auto root = [](int64_t square) {
    auto r = static_cast<int64_t>(std::sqrt(static_cast<double>(square)));
    while (r * r > square) {
      --r;
    }
    return r;
  };
  const int64_t radius = root(kSquaredRadius);
  for (int64_t x = -radius; x <= radius; ++x) {
    const int64_t most = root(kSquaredRadius - x * x);
    for (int64_t y = -most; y <= most; ++y) {
      const int64_t square = kSquaredRadius - x * x - y * y;
      const int64_t z = root(square);
      if (z * z != square) {
        continue;
      }
      for (const int64_t sign : {-1, 1}) {
        if (sign > 0 || z > 0) {
          for (const int64_t c : {x, y, sign * z}) {
            cloud.push_back(0.5 + kUnit * static_cast<double>(c));
          }
        }
      }
    }
  }
  return cloud;
}

TEST(DegenerateCostLongTest, Grid2) { ExpectCheap(2, FullBitGrid(2, 300)); }
TEST(DegenerateCostLongTest, Grid3) { ExpectCheap(3, FullBitGrid(3, 40)); }
TEST(DegenerateCostLongTest, Rounded2) { ExpectCheap(2, test::MakeCloud("rounded", 2, 30'000)); }
TEST(DegenerateCostLongTest, Rounded3) { ExpectCheap(3, test::MakeCloud("rounded", 3, 100'000)); }
TEST(DegenerateCostLongTest, Cospherical3) { ExpectCheap(3, LatticeSphere()); }

}  // namespace
}  // namespace wellspace::core
