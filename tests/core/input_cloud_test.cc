// Sorting of clouds, against its definition.
#include "core/input_cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/run_context.h"
#include "core/tree/morton.h"
#include "tests/support/brute_force.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

template <typename T>
class SortCloudTest : public test::SeededTest {
 protected:
  SortCloudTest() : SeededTest(1966) {}
};
TYPED_TEST_SUITE(SortCloudTest, test::AllDimensions);

// Points in groups so small that many share the first 32 bits of their places on the Z curve, or the first 64; some are given twice.
TYPED_TEST(SortCloudTest, SortsAlongTheCurveAndNamesTheFirstOfEquals) {
  constexpr int D = TypeParam::kValue;
  constexpr uint32_t kCount = 600;
  Box<D> box;
  box.low.fill(0);
  box.high.fill(1);
  const auto domain = Domain<D>::Of(box);
  ASSERT_TRUE(domain.ok());
  for (const int bits : {0, 32, 64}) {
    const double size = std::ldexp(bits == 0 ? 0.5 : 0.125, -(bits / D));
    std::vector<Point<D>> centres(4);
    for (Point<D>& centre : centres) {
      for (double& x : centre) {
        x = 0.25 + 0.5 * this->random_.Unit();
      }
    }
    std::vector<Point<D>> points;
    for (uint32_t i = 0; i < kCount; ++i) {
      if (i % 7 == 6) {
        points.push_back(points[this->random_.Below(i)]);
        continue;
      }
      Point<D> p = centres[i % centres.size()];
      for (double& x : p) {
        x += size * (this->random_.Unit() - 0.5);
      }
      points.push_back(p);
    }
    std::vector<double> coordinates;
    for (const Point<D>& p : points) {
      coordinates.insert(coordinates.end(), p.begin(), p.end());
    }

    const auto cloud = SortCloud<D>(*domain, coordinates, RunContext());
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    uint32_t alike = 0;
    for (size_t i = 1; i < cloud->points.size(); ++i) {
      const GridPoint<D> before = cloud->grid.CubeOf(cloud->points[i - 1]);
      const GridPoint<D> after = cloud->grid.CubeOf(cloud->points[i]);
      ASSERT_TRUE(MortonLess<D>(before, after)) << i << ", " << bits << " bits";
      const int levels = cloud->grid.levels();
      const uint64_t differing = MortonPrefix<D>(before, levels) ^ MortonPrefix<D>(after, levels);
      alike += bits == 0 ? 0 : bits == 32 ? differing >> 32 == 0 : differing == 0;
    }
    EXPECT_GE(alike, bits == 0 ? 0 : kCount / 2) << bits << " bits";
    const HugeVector<uint32_t> sorted_of_inputs = cloud->SortedOfInputs();
    ASSERT_EQ(sorted_of_inputs.size(), kCount);
    ASSERT_EQ(cloud->first_input.size(), cloud->points.size());
    for (uint32_t i = 0; i < kCount; ++i) {
      const uint32_t sorted = sorted_of_inputs[i];
      ASSERT_LT(sorted, cloud->points.size());
      EXPECT_EQ(cloud->points[sorted], points[i]);
      EXPECT_EQ(cloud->first_input[sorted], std::find(points.begin(), points.end(), points[i]) - points.begin());
    }
  }
}

}  // namespace
}  // namespace wellspace::core
