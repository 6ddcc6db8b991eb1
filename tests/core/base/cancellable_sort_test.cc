// Sorts that can be cancelled, against the standard ones.
#include "core/base/cancellable_sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using Item = std::pair<uint32_t, uint32_t>;

uint32_t KeyOf(const Item& item) { return item.first; }

class CancellableSortTest : public test::SeededTest {
 protected:
  CancellableSortTest() : SeededTest(1954) {}

  // `count` items with keys of which the bits of `mask` differ, numbered.
  std::vector<Item> Draw(size_t count, uint32_t mask) {
    std::vector<Item> items;
    for (uint32_t i = 0; i < count; ++i) {
      items.emplace_back(0x01234567 ^ (static_cast<uint32_t>(random_.Next()) & mask), i);
    }
    return items;
  }

  static bool HasSmallerKey(const Item& a, const Item& b) { return a.first < b.first; }
};

constexpr uint32_t kMasks[] = {0, 1, 0xff, 0xff00, 0xfffff, 0xf0f0f0f0, ~uint32_t{0}};

TEST_F(CancellableSortTest, ByRadixKeepsTheOrderOfEqualKeys) {
  const RunContext context;
  for (const size_t count : {0, 1, 2, 32, 300, 70'000}) {
    for (const uint32_t mask : kMasks) {
      std::vector<Item> items = Draw(count, mask);
      std::vector<Item> expected = items;
      std::stable_sort(expected.begin(), expected.end(), HasSmallerKey);
      std::vector<Item> scratch(count);
      ASSERT_TRUE(CancellableRadixSort(std::span(items), std::span(scratch), KeyOf, context).ok());
      ASSERT_EQ(items, expected) << count << " items, mask " << mask;
    }
  }
}

TEST_F(CancellableSortTest, ByComparisonsIsAnOrder) {
  const RunContext context;
  for (const size_t count : {0, 1, 2, 300, 70'000}) {
    for (const uint32_t mask : kMasks) {
      std::vector<Item> items = Draw(count, mask);
      std::vector<Item> expected = items;
      std::sort(expected.begin(), expected.end());
      ASSERT_TRUE(CancellableSort(items, std::less<Item>(), context).ok());
      ASSERT_EQ(items, expected) << count << " items, mask " << mask;
    }
  }
}

TEST_F(CancellableSortTest, IsCancelled) {
  RunContext context;
  context.Cancel();
  std::vector<Item> items = Draw(1000, ~uint32_t{0});
  EXPECT_TRUE(absl::IsCancelled(CancellableSort(items, std::less<Item>(), context)));
  std::vector<Item> scratch(items.size());
  EXPECT_TRUE(absl::IsCancelled(CancellableRadixSort(std::span(items), std::span(scratch), KeyOf, context)));
}

}  // namespace
}  // namespace wellspace::core
