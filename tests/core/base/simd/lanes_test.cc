// Computations side by side, against plain loops, and with each of the processor's units to the bit the same.
#include "core/base/simd/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/cell/candidates.h"
#include "core/cell/excesses.h"
#include "core/cell/node_columns.h"
#include "core/cell/polytope.h"
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

// Compiled for AVX2: to be called only where the processor has it.
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
TYPED_TEST_SUITE(LanesTest, test::Above3);

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
    const auto narrow_largest = baseline.FindLargest();
    const auto wide_largest = wide.FindLargest();
    EXPECT_EQ(narrow_largest.radius_sq, radius_sq);
    EXPECT_EQ(wide_largest.radius_sq, radius_sq);
    EXPECT_EQ(narrow_largest.slack, slack);
    EXPECT_EQ(wide_largest.slack, slack);
    Candidates<D> candidates;
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
        ASSERT_EQ(baseline.excesses()[i], wide.excesses()[i]);
        const double doubt = baseline.slack(i) * length + 1e-9;
        for (auto* columns : {&baseline, &wide}) {
          const auto& found = columns->found()[i / NodeColumns<D>::kWordBits];
          ASSERT_EQ((found.maybe >> i % NodeColumns<D>::kWordBits) & 1, columns->excesses()[i] + doubt >= 0 ? 1u : 0u);
          ASSERT_EQ((found.surely >> i % NodeColumns<D>::kWordBits) & 1, columns->excesses()[i] > doubt ? 1u : 0u);
        }
      }
      Point<D> low = DrawPoint<D>(random);
      Point<D> high = low;
      for (double& x : high) {
        x += 0.25;
      }
      ASSERT_EQ(baseline.Reaches(low, high, 1e-3), wide.Reaches(low, high, 1e-3));
    }
    Candidates<D> same = candidates;
    baseline.BoundExcesses(slack, 1e-9, 0, candidates);
    wide.BoundExcesses(slack, 1e-9, 0, same);
    EXPECT_TRUE(std::equal(candidates.excess_bound, candidates.excess_bound + candidates.count, same.excess_bound));
  }
}

// Nor later: the cell only shrinks.
TYPED_TEST(LanesTest, CandidatesBoundedNotToCutDoNot) {
  constexpr int D = TypeParam::kValue;
  SplitMix64& random = this->random_;
  Box<D> box;
  box.low.fill(-1);
  box.high.fill(1);
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  Polytope<D> cell;
  Candidates<D> candidates;
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
    cell.BoundExcesses(0, candidates);
    for (size_t j = 0; j < candidates.count; ++j) {
      const bool has_cut = cell.Cut(VertexId{next++}, points[j]);
      ASSERT_TRUE(!has_cut || candidates.excess_bound[j] >= 0);
      idle += candidates.excess_bound[j] < 0 ? 1 : 0;
      cutting += has_cut ? 1 : 0;
    }
  }
  EXPECT_GT(idle, 0);
  EXPECT_GT(cutting, 0);
}

template <typename T>
class CandidatesTest : public test::SeededTest {
 protected:
  CandidatesTest() : SeededTest(1966) {}

  // Candidates for a site, as many as are to be had, at few distances: many are equal.
  static Candidates<T::kValue> DrawCandidates(size_t count, SplitMix64& random) {
    Candidates<T::kValue> drawn;
    drawn.count = count;
    const uint64_t values = 1 + random.Below(2 * count + 1);
    for (size_t i = 0; i < count; ++i) {
      for (auto& column : drawn.w) {
        column[i] = Draw(random);
      }
      drawn.length_sq[i] = static_cast<double>(random.Below(values));
      drawn.excess_bound[i] = Draw(random);
      drawn.slot[i] = i;
    }
    return drawn;
  }

  // Candidate i of one is candidate j of the other.
  static bool IsSame(const Candidates<T::kValue>& a, size_t i, const Candidates<T::kValue>& b, size_t j) {
    bool is_same = a.length_sq[i] == b.length_sq[j] && a.slot[i] == b.slot[j];
    for (int axis = 0; axis < T::kValue; ++axis) {
      is_same &= a.w[axis][i] == b.w[axis][j];
    }
    return is_same;
  }
};
TYPED_TEST_SUITE(CandidatesTest, test::Above3);

TYPED_TEST(CandidatesTest, ArePickedWithinTheLimitButNotAtTheSite) {
  constexpr int D = TypeParam::kValue;
  SplitMix64& random = this->random_;
  Candidates<D> picked;
  for (const VectorUnit unit : Units()) {
    for (size_t count = 0; count <= LeafTree<D>::kLeafCapacity; count += count < 40 ? 1 : 19) {
      const Point<D> site = DrawPoint<D>(random);
      std::vector<Point<D>> positions(PaddedCount(count));
      for (Point<D>& p : positions) {
        p = random.Below(8) == 0 ? site : DrawPoint<D>(random);
      }
      // Often the very distance of one.
      const double limit_sq = count == 0 ? 1 : DistanceSq<D>(positions[random.Below(count)], site);
      picked.Pick({positions.data(), count}, site, limit_sq, unit);
      size_t expected = 0;
      for (size_t i = 0; i < count; ++i) {
        const Point<D> w = Difference<D>(positions[i], site);
        if (positions[i] == site || NormSq<D>(w) > limit_sq) {
          continue;
        }
        ASSERT_LT(expected, picked.count);
        ASSERT_EQ(picked.slot[expected], i);
        ASSERT_EQ(picked.length_sq[expected], NormSq<D>(w));
        for (int axis = 0; axis < D; ++axis) {
          ASSERT_EQ(picked.w[axis][expected], w[axis]);
        }
        ++expected;
      }
      ASSERT_EQ(picked.count, expected);
    }
  }
}

// A neighbour may be so near that the square of its distance is 0.
TYPED_TEST(CandidatesTest, ThatAreVeryNearAreNotTheSite) {
  constexpr int D = TypeParam::kValue;
  Point<D> near{};
  near[D - 1] = 1e-200;
  const std::vector<Point<D>> positions = {Point<D>{}, near, near, near};
  Candidates<D> picked;
  for (const VectorUnit unit : Units()) {
    picked.Pick({positions.data(), 2}, Point<D>{}, 1, unit);
    ASSERT_EQ(picked.count, 1u);
    EXPECT_EQ(picked.slot[0], 1u);
  }
}

TYPED_TEST(CandidatesTest, AreDroppedIfTheyMiss) {
  constexpr int D = TypeParam::kValue;
  SplitMix64& random = this->random_;
  for (const VectorUnit unit : Units()) {
    for (size_t count = 0; count <= LeafTree<D>::kLeafCapacity; count += count < 40 ? 1 : 19) {
      const Candidates<D> all = this->DrawCandidates(count, random);
      const size_t begin = random.Below(count + 1);
      Candidates<D> left = all;
      left.DropThoseThatMiss(begin, unit);
      size_t expected = 0;
      for (size_t i = 0; i < count; ++i) {
        if (i < begin || all.excess_bound[i] >= 0) {
          ASSERT_LT(expected, left.count);
          ASSERT_TRUE(this->IsSame(left, expected++, all, i));
        }
      }
      ASSERT_EQ(left.count, expected);
    }
  }
}

TYPED_TEST(CandidatesTest, AreSortedByDistance) {
  constexpr int D = TypeParam::kValue;
  SplitMix64& random = this->random_;
  Candidates<D> sorted;
  for (const VectorUnit unit : Units()) {
    for (size_t count = 0; count <= LeafTree<D>::kLeafCapacity; count += count < 70 ? 1 : 19) {
      const Candidates<D> all = this->DrawCandidates(count, random);
      sorted.Sort(all, unit);
      ASSERT_EQ(sorted.count, count);
      std::vector<bool> has_come(count, false);
      for (size_t j = 0; j < count; ++j) {
        const size_t i = sorted.slot[j];
        ASSERT_LT(i, count);
        ASSERT_FALSE(has_come[i]);
        has_come[i] = true;
        ASSERT_TRUE(this->IsSame(sorted, j, all, i));
        if (j > 0) {
          ASSERT_LE(sorted.length_sq[j - 1], sorted.length_sq[j] * (1 + 0x1p-13));
        }
      }
    }
  }
}

}  // namespace
}  // namespace wellspace::core
