// The grid under the tree, and the Z order on it, against their definitions.
#include "core/tree/morton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/core/tree/tree_boxes.h"
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
  for (const MortonGrid<D>& grid : Grids<D>()) {
    const Box<D>& box = grid.box();
    EXPECT_EQ(grid.root_side(), std::ldexp(grid.quantum(), grid.levels()));
    EXPECT_LT(grid.root_side(), 2 * box.LongestSide() + 2 * grid.quantum());
    EXPECT_EQ(std::remainder(4 * grid.quantum(), grid.step()), 0);
    EXPECT_GE(grid.quantum(), grid.step());
    EXPECT_LT(grid.quantum(), 2 * grid.step());
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

// In 3-D some level has a good number of evenly spread points to a cube, in a box of whatever shape and for whatever
// number of points; elsewhere the root is as small as can be.
TYPED_TEST(MortonTest, RootFitsTheNumberOfPoints) {
  constexpr int D = TypeParam::kValue;
  for (const Box<D>& box : Boxes<D>()) {
    double volume = 1;
    for (int k = 0; k < D; ++k) {
      volume *= box.high[k] - box.low[k];
    }
    const double smallest = MortonGrid<D>(box).root_side();
    EXPECT_EQ(std::ldexp(1.0, std::ilogb(smallest)), smallest);
    EXPECT_LE(smallest / 2, box.LongestSide());
    for (size_t count = 1; count < 100'000'000; count += 1 + count / 7) {
      const double side = MortonGrid<D>(box, count).root_side();
      if (D != 3) {
        ASSERT_EQ(side, smallest);
        continue;
      }
      double in_cube = static_cast<double>(count) * std::pow(side, D) / volume;
      while (in_cube >= 16) {
        in_cube /= 8;
      }
      while (in_cube < 4) {
        in_cube *= 8;
      }
      ASSERT_GE(in_cube, 8 / 1.45) << count;
      ASSERT_LE(in_cube, 8 * 1.45) << count;
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
    const uint64_t upper_half = MortonPrefix<D, 32>(cube, levels) >> 32;
    EXPECT_EQ(upper_half, expected >> 32) << ::testing::PrintToString(cube) << " of " << levels;
  }
}

}  // namespace
}  // namespace wellspace::core
