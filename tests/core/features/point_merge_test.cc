// Points that become one: equal ones, and corners of rings that are nearer to each other than doubles serve.
#include "core/features/point_merge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <vector>

#include "core/geometry/point.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

constexpr double kSeparation = 1e-3;

class PointMergeTest : public test::SeededTest {
 protected:
  PointMergeTest() : SeededTest(0x3e12) {}

  static PointMerge Merge(const std::vector<double>& points, const std::vector<uint32_t>& ends,
                          const std::vector<uint8_t>& is_open = {}) {
    Features features;
    features.ends = ends;
    features.is_open = is_open;
    const absl::StatusOr<PointMerge> merge = MergeTwins(points, features, kSeparation, RunContext());
    EXPECT_TRUE(merge.ok()) << merge.status();
    return merge.ok() ? *merge : PointMerge();
  }
};

TEST_F(PointMergeTest, EqualPointsAreOneAndKeepTheFirstPlace) {
  const PointMerge merge = Merge({1, 0, 0, 0, 1, 0, 0, 0}, {});
  EXPECT_EQ(merge.place_of, (std::vector<uint32_t>{0, 1, 0, 1}));
  EXPECT_EQ(merge.inputs, (std::vector<uint32_t>{0, 1}));
  EXPECT_EQ(merge.equal, 2u);
  EXPECT_EQ(merge.merged, 0u);
}

TEST_F(PointMergeTest, TwinsThatAreCornersAreOneAndPlacesAreInTheOrderOfFirstUse) {
  // The second of the twins comes first by its coordinates, and stays.
  const std::vector<double> points = {1.0005, 0, 5, 5, 1, 0};
  const PointMerge merge = Merge(points, {0, 1, 1, 2});
  EXPECT_EQ(merge.place_of, (std::vector<uint32_t>{0, 1, 0}));
  EXPECT_EQ(merge.inputs, (std::vector<uint32_t>{2, 1}));
  EXPECT_EQ(merge.merged, 1u);
}

TEST_F(PointMergeTest, OtherPointsAndEndsOfLinesStay) {
  EXPECT_EQ(Merge({1, 0, 1.0005, 0, 2, 0}, {0, 2}).merged, 0u);
  EXPECT_EQ(Merge({1, 0, 1.0005, 0, 2, 0}, {0, 2, 1, 2}, {0, 1}).merged, 0u);
  EXPECT_EQ(Merge({1, 0, 1.0005, 0, 2, 0}, {0, 2, 1, 2}, {0, 0}).merged, 1u);
}

// All pairs, in the order that is promised.
std::vector<Point<2>> Thinned(std::vector<Point<2>> points) {
  std::sort(points.begin(), points.end());
  std::vector<Point<2>> stayed;
  for (const Point<2>& p : points) {
    if (std::none_of(stayed.begin(), stayed.end(),
                     [&](const Point<2>& q) { return DistanceSq<2>(p, q) < kSeparation * kSeparation; })) {
      stayed.push_back(p);
    }
  }
  return stayed;
}

TEST_F(PointMergeTest, WhatStaysIsFarApartAndTheSameInAnyOrder) {
  for (int run = 0; run < 200; ++run) {
    const size_t count = 2 + random_.Below(60);
    std::vector<double> points;
    for (size_t i = 0; i < count; ++i) {
      points.push_back(random_.Unit() * 0.01);
      points.push_back(random_.Below(3) == 0 ? 0.5 : random_.Unit() * 0.01);
    }
    std::vector<uint32_t> ends(count);
    std::iota(ends.begin(), ends.end(), 0);
    ends.resize(count + count % 2);  // all are corners
    const PointMerge merge = Merge(points, ends);
    std::vector<Point<2>> stayed;
    for (const uint32_t input : merge.inputs) {
      stayed.push_back(PointAt<2>(points, input));
    }
    std::sort(stayed.begin(), stayed.end());
    std::vector<Point<2>> given;
    for (size_t i = 0; i < count; ++i) {
      const Point<2> p = PointAt<2>(points, i);
      given.push_back(p);
      const Point<2> now = PointAt<2>(points, merge.inputs[merge.place_of[i]]);
      EXPECT_LT(DistanceSq<2>(p, now), kSeparation * kSeparation);
    }
    EXPECT_EQ(stayed, Thinned(given));
    EXPECT_EQ(merge.inputs.size() + merge.merged + merge.equal, count);
  }
}

TEST_F(PointMergeTest, ARunThatIsCancelledMergesNothing) {
  RunContext context;
  context.Cancel();
  EXPECT_EQ(MergeTwins(std::vector<double>{0, 0}, Features(), kSeparation, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
