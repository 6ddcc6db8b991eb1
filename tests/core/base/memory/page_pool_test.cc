// Runs of pages from the pool: places, order, return, and threads that share it.
#include "core/base/memory/page_pool.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "tests/core/base/memory/is_mapped.h"

namespace wellspace::core {
namespace {

constexpr size_t kPage = 4096;

struct Run {
  std::byte* memory = nullptr;
  size_t bytes = 0;
};

std::byte* Take(PagePool& pool, size_t bytes) { return static_cast<std::byte*>(pool.Take(bytes)); }

TEST(PagePoolTest, RunsBeginAtPagesSideBySide) {
  PagePool pool;
  std::byte* const first = Take(pool, 1);
  std::byte* const second = Take(pool, kPage + 1);
  std::byte* const third = Take(pool, kPage);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(first) % kHugePage, 0u);
  EXPECT_EQ(second, first + kPage);
  EXPECT_EQ(third, first + 3 * kPage);
  pool.GiveBack(first, 1);
  pool.GiveBack(second, kPage + 1);
  pool.GiveBack(third, kPage);
}

TEST(PagePoolTest, TheFirstRunThatIsLongEnoughIsTaken) {
  PagePool pool;
  std::vector<std::byte*> runs;
  for (const size_t pages : {2, 1, 3, 1}) {
    runs.push_back(Take(pool, pages * kPage));
  }
  pool.GiveBack(runs[0], 2 * kPage);
  pool.GiveBack(runs[2], 3 * kPage);
  EXPECT_EQ(Take(pool, 3 * kPage), runs[2]);
  EXPECT_EQ(Take(pool, kPage), runs[0]);
  EXPECT_EQ(Take(pool, 2 * kPage), runs[3] + kPage);
  EXPECT_EQ(Take(pool, kPage), runs[0] + kPage);
  // As large as any: it needs a large page of its own, and blocks on the first are served from there.
  std::byte* const whole = Take(pool, kHugePage);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(whole) % kHugePage, 0u);
  EXPECT_NE(whole, runs[0]);
  EXPECT_EQ(Take(pool, kPage), runs[3] + 3 * kPage);
}

TEST(PagePoolTest, ALargePageGoesWithTheLastOnItButOne) {
  std::optional<PagePool> pool(std::in_place);
  std::byte* const first = Take(*pool, kHugePage / 2);
  std::byte* const second = Take(*pool, kHugePage / 2);
  std::byte* const third = Take(*pool, kHugePage);
  second[kHugePage / 2 - 1] = third[0] = std::byte{1};
  pool->GiveBack(first, kHugePage / 2);
  EXPECT_TRUE(test::IsMapped(second));
  pool->GiveBack(second, kHugePage / 2);
  EXPECT_TRUE(test::IsMapped(first)) << "for the next array";
  pool->GiveBack(third, kHugePage);
  EXPECT_FALSE(test::IsMapped(third));
  EXPECT_EQ(Take(*pool, kHugePage), first);
  std::byte* const fourth = Take(*pool, kHugePage);
  pool->GiveBack(fourth, kHugePage);
  EXPECT_TRUE(test::IsMapped(fourth)) << "nothing else is free now";
  pool->GiveBack(first, kHugePage);
  EXPECT_FALSE(test::IsMapped(first));
  pool.reset();
  EXPECT_FALSE(test::IsMapped(fourth));
}

// Takes and gives back at random; a run that was taken holds the bytes written to it.
void TakeAtRandom(PagePool& pool, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<Run> runs;
  const auto give_back = [&](size_t at) {
    std::swap(runs[at], runs.back());
    const auto [memory, bytes] = runs.back();
    const auto mark = static_cast<std::byte>(bytes % 251);
    ASSERT_EQ(std::count(memory, memory + bytes, mark), static_cast<ptrdiff_t>(bytes));
    pool.GiveBack(memory, bytes);
    runs.pop_back();
  };
  for (int i = 0; i < 300; ++i) {
    if (runs.size() > 12) {
      ASSERT_NO_FATAL_FAILURE(give_back(generator() % runs.size()));
    }
    const size_t bytes = 1 + generator() % (generator() % 4 == 0 ? kHugePage : kHugePage / 16);
    runs.push_back({Take(pool, bytes), bytes});
    std::memset(runs.back().memory, static_cast<int>(bytes % 251), bytes);
  }
  while (!runs.empty()) {
    ASSERT_NO_FATAL_FAILURE(give_back(runs.size() - 1));
  }
}

TEST(PagePoolTest, WhatIsTakenIsTheTakersAlone) {
  PagePool pool;
  TakeAtRandom(pool, 1);
}

TEST(PagePoolTest, ThreadsShareOne) {
  PagePool pool;
  std::vector<std::thread> threads;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    threads.emplace_back([&pool, seed] { TakeAtRandom(pool, seed); });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
}

}  // namespace
}  // namespace wellspace::core
