// What is computed side by side, against plain loops, and with each of the processor's units to the bit the same.
#include "core/voronoi/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
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

// What the processor is asked for only where it has it.
template <int D>
WELLSPACE_AVX2 typename NodeColumns<D>::Largest FindLargestAvx2(const NodeColumns<D>& columns) {
  return columns.template FindLargest<4>();
}
template <int D>
WELLSPACE_AVX2 bool ComputeExcessesAvx2(const Point<D>& normal, double offset, double length, double error,
                                        NodeColumns<D>& columns) {
  return columns.template ComputeExcesses<4>(normal, offset, length, error);
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
  for (size_t count = 1; count < 150; count += count < 40 ? 1 : 13) {
    NodeColumns<D> baseline(VectorUnit::kBaseline);
    NodeColumns<D> wide(VectorUnit::kAvx2);
    baseline.Resize(count);
    wide.Resize(count);
    double radius_sq = 0;
    double slack = 0;
    for (size_t i = 0; i < count; ++i) {
      const Point<D> x = DrawPoint<D>(random);
      const double error = 1e-3 * (1 + Draw(random));
      radius_sq = std::max(radius_sq, NormSq<D>(x));
      slack = std::max(slack, error);
      baseline.Set(i, x, error);
      wide.Set(i, x, error);
    }
    const auto narrow_largest = baseline.template FindLargest<2>();
    const auto wide_largest = FindLargestAvx2<D>(wide);
    EXPECT_EQ(narrow_largest.radius_sq, radius_sq);
    EXPECT_EQ(wide_largest.radius_sq, radius_sq);
    EXPECT_EQ(narrow_largest.slack, slack);
    EXPECT_EQ(wide_largest.slack, slack);
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
      ASSERT_EQ(baseline.template ComputeExcesses<2>(normal, offset, length, 1e-9),
                ComputeExcessesAvx2<D>(normal, offset, length, 1e-9, wide));
      for (size_t i = 0; i < count; ++i) {
        ASSERT_EQ(baseline.excess(i), wide.excess(i));
        const double doubt = baseline.slack(i) * length + 1e-9;
        for (auto* columns : {&baseline, &wide}) {
          const auto& found = columns->found()[i / NodeColumns<D>::kWordBits];
          ASSERT_EQ((found.maybe >> i % NodeColumns<D>::kWordBits) & 1, columns->excess(i) + doubt >= 0 ? 1u : 0u);
          ASSERT_EQ((found.surely >> i % NodeColumns<D>::kWordBits) & 1, columns->excess(i) > doubt ? 1u : 0u);
        }
      }
      Point<D> low = DrawPoint<D>(random);
      Point<D> high = low;
      for (double& x : high) {
        x += 0.25;
      }
      ASSERT_EQ(baseline.Reaches(low, high, 1e-3), wide.Reaches(low, high, 1e-3));
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
