// The grid under the tree, and the Z order on it, against their definitions.
#include "core/tree/morton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/core/tree_boxes.h"
#include "tests/support/brute_force.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

template <typename T>
class MortonTest : public test::SeededTest {
 protected:
  MortonTest() : SeededTest(1990) {}
};
TYPED_TEST_SUITE(MortonTest, test::AllDimensions);

// Invariants of MortonGrid.
TYPED_TEST(MortonTest, GridHoldsTheBoxInExactCubes) {
  constexpr int D = TypeParam::kValue;
  for (const Box<D>& box : Boxes<D>()) {
    const MortonGrid<D> grid(box);
    EXPECT_EQ(grid.root_side(), std::ldexp(grid.quantum(), grid.levels()));
    for (int k = 0; k < D; ++k) {
      EXPECT_LE(grid.root_low()[k], box.low[k]);
      EXPECT_GE(grid.root_low()[k] + grid.root_side(), box.high[k]);
    }
    for (int i = 0; i < 200; ++i) {
      Point<D> p;
      for (int k = 0; k < D; ++k) {
        p[k] = std::min(box.low[k] + this->random_.Unit() * (box.high[k] - box.low[k]), box.high[k]);
      }
      const GridPoint<D> cube = grid.CubeOf(p);
      for (int k = 0; k < D; ++k) {
        const double low = grid.root_low()[k] + static_cast<double>(cube[k]) * grid.quantum();
        EXPECT_LE(low, p[k]);
        EXPECT_GE(low + grid.quantum(), p[k]);
      }
    }
    for (const uint64_t last : grid.CubeOf(box.high)) {
      EXPECT_LT(last, uint64_t{1} << grid.levels());
    }
  }
}

// The Z order by its definition: the bits of all axes interleaved, axis D - 1 first.
TYPED_TEST(MortonTest, MortonOrderIsThatOfInterleavedBits) {
  constexpr int D = TypeParam::kValue;
  const auto interleaved = [](const GridPoint<D>& p) {
    std::vector<uint64_t> bits;
    for (int bit = 51; bit >= 0; --bit) {
      for (int k = D - 1; k >= 0; --k) {
        bits.push_back(p[k] >> bit & 1);
      }
    }
    return bits;
  };
  for (int i = 0; i < 500; ++i) {
    GridPoint<D> a;
    GridPoint<D> b;
    for (int k = 0; k < D; ++k) {
      a[k] = this->random_.Next() >> (12 + this->random_.Below(52));
      b[k] = this->random_.Below(2) == 0 ? a[k] : this->random_.Next() >> (12 + this->random_.Below(52));
    }
    EXPECT_EQ(MortonLess<D>(a, b), interleaved(a) < interleaved(b))
        << ::testing::PrintToString(a) << ::testing::PrintToString(b);
  }
}

TYPED_TEST(MortonTest, MortonPrefixesAreTheFirstInterleavedBits) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 500; ++i) {
    const int levels = 1 + static_cast<int>(this->random_.Below(52));
    GridPoint<D> cube;
    for (uint64_t& x : cube) {
      x = this->random_.Next() >> (64 - levels);
    }
    uint64_t expected = 0;
    for (int level = 1; level <= 64 / D; ++level) {
      for (int k = D - 1; k >= 0; --k) {
        expected = expected << 1 | (level <= levels ? cube[k] >> (levels - level) & 1 : 0);
      }
    }
    EXPECT_EQ(MortonPrefix<D>(cube, levels), expected) << ::testing::PrintToString(cube) << " of " << levels;
  }
}

}  // namespace
}  // namespace wellspace::core
