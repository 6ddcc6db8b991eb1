// The sort of few items, against the standard one and the sign of the permutation.
#include "core/base/sort_few.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace wellspace::core {
namespace {

TEST(SortFewTest, SortsEveryPermutationAndKnowsItsSign) {
  constexpr std::array<uint32_t, 5> kSorted = {0, 1, 7, 1u << 31, std::numeric_limits<uint32_t>::max()};
  std::array<uint32_t, 5> items = kSorted;
  int permutations = 0;
  do {
    int inversions = 0;
    for (size_t i = 0; i < items.size(); ++i) {
      for (size_t j = i + 1; j < items.size(); ++j) {
        inversions += items[i] > items[j] ? 1 : 0;
      }
    }
    std::array<uint32_t, 5> sorted = items;
    EXPECT_EQ(SortFew(sorted), inversions % 2 != 0);
    EXPECT_EQ(sorted, kSorted);
    ++permutations;
  } while (std::next_permutation(items.begin(), items.end()));
  EXPECT_EQ(permutations, 120);
}

TEST(SortFewTest, TakesAllBitsOfLongItems) {
  std::array<uint64_t, 3> items = {uint64_t{1} << 63, uint64_t{1} << 32, 5};
  EXPECT_TRUE(SortFew(items));
  EXPECT_EQ(items, (std::array<uint64_t, 3>{5, uint64_t{1} << 32, uint64_t{1} << 63}));
}

TEST(SortFewTest, DoesNotExchangeEqualItems) {
  std::array<uint32_t, 3> items = {4, 4, 2};
  EXPECT_FALSE(SortFew(items));
  EXPECT_EQ(items, (std::array<uint32_t, 3>{2, 4, 4}));
}

}  // namespace
}  // namespace wellspace::core
