// What is computed side by side, against plain loops, and with each of the processor's units to the bit the same.
#include "core/voronoi/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "core/voronoi/nearness.h"
#include "core/voronoi/node_columns.h"
#include "core/voronoi/polytope.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::SplitMix64;

std::vector<VectorUnit> Units() {
  std::vector<VectorUnit> units = {VectorUnit::kBaseline};
  if (Has(VectorUnit::kAvx2)) {
    units.push_back(VectorUnit::kAvx2);
  }
  return units;
}

// From -1 to 1.
double Draw(SplitMix64& random) { return std::ldexp(static_cast<double>(random.Below(1u << 30)), -29) - 1; }

template <int D>
Point<D> DrawPoint(SplitMix64& random) {
  Point<D> p;
  for (double& x : p) {
    x = Draw(random);
  }
  return p;
}

class NearnessTest : public test::SeededTest {
 protected:
  NearnessTest() : SeededTest(1966) {}
};

TEST_F(NearnessTest, OrdersByDistanceAndThenByNumber) {
  alignas(kLanes * sizeof(double)) std::array<double, 204> distances;
  for (const VectorUnit unit : Units()) {
    for (size_t count = 0; count <= 200; ++count) {
      // Few values: many are equal.
      const uint64_t values = 1 + random_.Below(2 * count + 1);
      for (double& distance : distances) {
        distance = static_cast<double>(random_.Below(values));
      }
      std::vector<uint32_t> expected(count);
      std::iota(expected.begin(), expected.end(), 0);
      std::stable_sort(expected.begin(), expected.end(),
                       [&](uint32_t a, uint32_t b) { return distances[a] < distances[b]; });
      std::vector<uint32_t> order(count + 1);
      OrderByDistance(distances.data(), count, order.data(), unit);
      order.resize(count);
      ASSERT_EQ(order, expected);
    }
  }
}

TEST_F(NearnessTest, TheQueueGivesTheNearestLeafOfTheLowestNumber) {
  for (const VectorUnit unit : Units()) {
    LeafQueue queue(unit);
    std::vector<std::pair<double, uint32_t>> model;
    uint32_t next = 0;
    for (int step = 0; step < 5000; ++step) {
      if (random_.Below(9) < 5) {
        model.emplace_back(static_cast<double>(random_.Below(20)), (next += 7) % 10007);
        queue.Push(model.back().first, NodeId{model.back().second});
      } else if (!model.empty()) {
        const auto nearest = std::min_element(model.begin(), model.end());
        ASSERT_FALSE(queue.IsEmpty());
        const LeafQueue::Entry entry = queue.Pop();
        ASSERT_EQ(std::pair(entry.distance_sq, Index(entry.leaf)), *nearest);
        model.erase(nearest);
      }
    }
    queue.Clear();
    EXPECT_TRUE(queue.IsEmpty());
  }
}

template <typename T>
class LanesTest : public test::SeededTest {
 protected:
  LanesTest() : SeededTest(1982) {}
};
TYPED_TEST_SUITE(LanesTest, test::AllDimensions);

TYPED_TEST(LanesTest, EveryUnitComputesTheSame) {
  constexpr int D = TypeParam::kValue;
  if (!Has(VectorUnit::kAvx2)) {
    GTEST_SKIP() << "this processor has one unit";
  }
  SplitMix64& random = this->random_;
  for (size_t count = 1; count < 40; ++count) {
    NodeColumns<D> baseline(VectorUnit::kBaseline);
    NodeColumns<D> wide(VectorUnit::kAvx2);
    baseline.Resize(count);
    wide.Resize(count);
    double reach = 0;
    double slack = 0;
    for (size_t i = 0; i < count; ++i) {
      const Point<D> x = DrawPoint<D>(random);
      const double error = 1e-3 * (1 + Draw(random));
      const double length = std::sqrt(NormSq<D>(x)) + error;
      reach = std::max(reach, length);
      slack = std::max(slack, error);
      baseline.Set(i, x, error, length);
      wide.Set(i, x, error, length);
    }
    for (const auto& columns : {baseline, wide}) {
      EXPECT_EQ(columns.FindLargest().reach, reach);
      EXPECT_EQ(columns.FindLargest().slack, slack);
    }
    CandidateColumns<D> candidates;
    candidates.count = 11;
    for (size_t j = 0; j < candidates.count; ++j) {
      const Point<D> normal = DrawPoint<D>(random);
      for (int axis = 0; axis < D; ++axis) {
        candidates.w[axis][j] = normal[axis];
      }
      candidates.length_sq[j] = NormSq<D>(normal);
      const double length = std::sqrt(NormSq<D>(normal));
      const double offset = 0.5 * NormSq<D>(normal);
      ASSERT_EQ(baseline.ComputeExcesses(normal, offset, length, 1e-9),
                wide.ComputeExcesses(normal, offset, length, 1e-9));
      for (size_t i = 0; i < count; ++i) {
        ASSERT_EQ(baseline.excess(i), wide.excess(i));
      }
      std::array<uint16_t, 64> one{};
      std::array<uint16_t, 64> other{};
      const size_t exceeding = baseline.FindExceeding(one.data());
      ASSERT_EQ(exceeding, wide.FindExceeding(other.data()));
      EXPECT_TRUE(std::equal(one.begin(), one.begin() + static_cast<std::ptrdiff_t>(exceeding), other.begin()));
      Point<D> low = DrawPoint<D>(random);
      Point<D> high = low;
      for (double& x : high) {
        x += 0.25;
      }
      ASSERT_EQ(baseline.Reaches(low, high), wide.Reaches(low, high));
    }
    CandidateColumns<D> same = candidates;
    baseline.ComputeMost(slack, 1e-9, candidates);
    wide.ComputeMost(slack, 1e-9, same);
    EXPECT_TRUE(std::equal(candidates.most, candidates.most + candidates.count, same.most));
  }
}

// Nor later: the cell only shrinks.
TYPED_TEST(LanesTest, WhoIsForetoldNotToCutDoesNot) {
  constexpr int D = TypeParam::kValue;
  SplitMix64& random = this->random_;
  Box<D> box;
  box.low.fill(-1);
  box.high.fill(1);
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  Polytope<D> cell;
  CandidateColumns<D> candidates;
  uint32_t next = 0;
  int idle = 0;
  int cutting = 0;
  for (int round = 0; round < 20; ++round) {
    const Point<D> site = DrawPoint<D>(random);
    cell.Reset(site, box, kinds, TieRule::kKeep);
    for (int i = 0; i < 4 * D; ++i) {
      cell.Cut(VertexId{next++}, DrawPoint<D>(random));
    }
    std::vector<Point<D>> points;
    candidates.count = 13;
    for (size_t j = 0; j < candidates.count; ++j) {
      points.push_back(DrawPoint<D>(random));
      const Point<D> w = Difference<D>(points.back(), site);
      for (int axis = 0; axis < D; ++axis) {
        candidates.w[axis][j] = w[axis];
      }
      candidates.length_sq[j] = NormSq<D>(w);
    }
    cell.Foretell(candidates);
    for (size_t j = 0; j < candidates.count; ++j) {
      const bool has_cut = cell.Cut(VertexId{next++}, points[j]);
      ASSERT_TRUE(!has_cut || candidates.most[j] >= 0);
      idle += candidates.most[j] < 0 ? 1 : 0;
      cutting += has_cut ? 1 : 0;
    }
  }
  EXPECT_GT(idle, 0);
  EXPECT_GT(cutting, 0);
}

}  // namespace
}  // namespace wellspace::core
