// Vectors on large pages keep their items, begin where they should and give memory back to the system.
#include "core/base/memory/huge_pages.h"

#include <cstddef>
#include <cstdint>
#include <new>

#include "gtest/gtest.h"
#include "tests/core/base/memory/is_mapped.h"

namespace wellspace::core {
namespace {

constexpr size_t kCountOnHugePage = kHugePage / sizeof(uint32_t);

bool IsAligned(const void* memory) { return reinterpret_cast<uintptr_t>(memory) % kHugePage == 0; }

TEST(HugePagesTest, AVectorKeepsItsItemsAsItGrows) {
  HugeVector<uint32_t> items;
  for (uint32_t i = 0; i < 3 * kCountOnHugePage; ++i) {
    items.push_back(i);
  }
  for (uint32_t i = 0; i < items.size(); ++i) {
    ASSERT_EQ(items[i], i);
  }
  const HugeVector<uint32_t> copy = items;
  EXPECT_EQ(copy, items);
}

#ifndef __SANITIZE_ADDRESS__
TEST(HugePagesTest, SmallerArraysShareAPage) {
  const HugeVector<uint32_t> first(kCountOnHugePage / 8, 1);
  const HugeVector<uint32_t> second(kCountOnHugePage / 8, 2);
  const auto page_of = [](const HugeVector<uint32_t>& items) {
    return reinterpret_cast<uintptr_t>(items.data()) / kHugePage;
  };
  EXPECT_EQ(page_of(first), page_of(second));
  EXPECT_EQ(first, HugeVector<uint32_t>(first.size(), 1));
}
#endif

TEST(HugePagesTest, ArraysOfAWholePageBeginAtOne) {
  for (const size_t count : {kCountOnHugePage, kCountOnHugePage + 1, 5 * kCountOnHugePage - 1}) {
    HugeVector<uint32_t> items(count, 7);
    EXPECT_TRUE(IsAligned(items.data())) << count;
    EXPECT_EQ(items.back(), 7u);
  }
}

TEST(HugePagesTest, WhatIsGivenBackIsTheSystemsAtOnce) {
  HugeVector<uint32_t> items(2 * kCountOnHugePage, 7);
  uint32_t* const memory = items.data();
  EXPECT_TRUE(test::IsMapped(memory));
  items = HugeVector<uint32_t>();
  EXPECT_FALSE(test::IsMapped(memory));
  EXPECT_FALSE(test::IsMapped(memory + 2 * kCountOnHugePage - 1024));
}

TEST(HugePagesTest, MoreThanThereIsIsRefused) {
  EXPECT_THROW(HugePageAllocator<uint64_t>().allocate(SIZE_MAX / 4), std::bad_alloc);
  EXPECT_THROW(HugePageAllocator<uint64_t>().allocate(size_t{1} << 56), std::bad_alloc);
}

TEST(HugePagesTest, BytesMayBeWrittenToTheLast) {
  for (const size_t count : {size_t{1000}, size_t{100'000}, kHugePage - 1, kHugePage, kHugePage + 1}) {
    const HugePageBytes bytes = MakeHugePageBytes(count);
    bytes[0] = std::byte{1};
    bytes[count - 1] = std::byte{2};
    EXPECT_EQ(bytes[count - 1], std::byte{2});
  }
}

}  // namespace
}  // namespace wellspace::core
