// Sorting of clouds, against its definition.
#include "core/input/sorted_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/run_context.h"
#include "core/input/frame.h"
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

// Points in groups so small that many share the first 32 bits of their places on the Z curve, or the first 64; some are
// given twice.
TYPED_TEST(SortCloudTest, SortsAlongTheCurveAndNamesTheFirstOfEquals) {
  constexpr int D = TypeParam::kValue;
  constexpr uint32_t kCount = 600;
  const auto domain = Frame<D>::Of(test::UnitBox<D>());
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

    const auto cloud = SortCloud<D>(*domain, coordinates, 1, RunContext());
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

// So many that threads share them out.
template <typename T>
class SortManyTest : public test::SeededTest {
 protected:
  static constexpr int kD = T::kValue;
  static constexpr uint32_t kMany = 3 * kStepsBetweenChecks + 5;

  SortManyTest() : SeededTest(1967), domain_(*Frame<kD>::Of(test::UnitBox<kD>())) {
    for (uint32_t i = 0; i < kMany * kD; ++i) {
      coordinates_.push_back(random_.Unit());
    }
  }

  // Gives point `to` the coordinates of point `from`.
  void Copy(uint32_t from, uint32_t to) {
    std::copy_n(coordinates_.begin() + from * kD, kD, coordinates_.begin() + to * kD);
  }

  Frame<kD> domain_;
  std::vector<double> coordinates_;
};
TYPED_TEST_SUITE(SortManyTest, test::AllDimensions);

TYPED_TEST(SortManyTest, IsTheSameByAnyNumberOfThreads) {
  constexpr int D = TypeParam::kValue;
  constexpr uint32_t kCount = TestFixture::kMany;
  for (uint32_t i = 0; i < 1000; ++i) {
    this->Copy(i, kCount - 1 - i);
  }
  for (const int threads : {1, 2}) {
    const auto cloud = SortCloud<D>(this->domain_, this->coordinates_, threads, RunContext());
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    ASSERT_EQ(cloud->points.size(), kCount - 1000);
    ASSERT_EQ(cloud->first_input.size(), kCount - 1000);
    EXPECT_EQ(cloud->duplicates.size(), 1000u);
    for (size_t i = 1; i < cloud->points.size(); ++i) {
      ASSERT_TRUE(MortonLess<D>(cloud->grid.CubeOf(cloud->points[i - 1]), cloud->grid.CubeOf(cloud->points[i]))) << i;
    }
    const HugeVector<uint32_t> sorted_of_inputs = cloud->SortedOfInputs();
    for (uint32_t i = 0; i < kCount; ++i) {
      const uint32_t first = i >= kCount - 1000 ? kCount - 1 - i : i;
      ASSERT_EQ(cloud->points[sorted_of_inputs[i]], PointAt<D>(this->coordinates_, i));
      ASSERT_EQ(cloud->first_input[sorted_of_inputs[i]], first);
    }
  }
}

TYPED_TEST(SortManyTest, NamesTheFirstPointThatIsWrong) {
  constexpr int D = TypeParam::kValue;
  const size_t first = kStepsBetweenChecks + 7;
  this->coordinates_[first * D] = 2;
  this->coordinates_[(first + 1) * D] = 3;
  this->coordinates_[(2 * kStepsBetweenChecks + 1) * D] = std::nan("");
  for (const int threads : {1, 2}) {
    const auto cloud = SortCloud<D>(this->domain_, this->coordinates_, threads, RunContext());
    EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(cloud.status().message()), testing::StartsWith("points[65543] = (2"));
  }
}

TYPED_TEST(SortManyTest, StopsWhenCancelled) {
  RunContext context;
  context.Cancel();
  const auto cloud = SortCloud<TypeParam::kValue>(this->domain_, this->coordinates_, 2, context);
  EXPECT_EQ(cloud.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
