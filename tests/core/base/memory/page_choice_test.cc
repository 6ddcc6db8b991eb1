// When large pages are asked for, by times that the test makes up.
#include "core/base/memory/page_choice.h"

#include <cstddef>

#include "gtest/gtest.h"

namespace wellspace::core {
namespace {

constexpr double kMillisecond = 1e6;

// Maps so many large pages one by one where each, and as much memory on small ones, takes so many milliseconds; returns
// how many are on large pages.
int MapLarge(PageChoice& choice, int count, double large_ms, double small_ms) {
  int large = 0;
  for (int i = 0; i < count; ++i) {
    if (choice.TakesLarge(kHugePage)) {
      ++large;
      choice.IsDear(large_ms * kMillisecond, [=] { return small_ms * kMillisecond; });
    }
  }
  return large;
}

TEST(PageChoiceTest, LargePagesAreTakenUnlessTheyAreDear) {
  PageChoice choice;
  EXPECT_EQ(MapLarge(choice, 100, 0.25, 0.4), 100);
  EXPECT_EQ(MapLarge(choice, 100, 0.6, 0.3), 100);
  EXPECT_EQ(MapLarge(choice, 100, 4, 4), 100);
  EXPECT_EQ(MapLarge(choice, 100, 3.6, 5.6), 100);
  EXPECT_EQ(MapLarge(choice, 10, 4, 0.4), 1);
}

TEST(PageChoiceTest, WhereTheyAreDearOneIsTriedNowAndThen) {
  PageChoice choice;
  constexpr int kBetweenTries = PageChoice::kBetweenTries / kHugePage;
  EXPECT_EQ(MapLarge(choice, 10 * kBetweenTries, 4, 0.4), 10);
}

TEST(PageChoiceTest, WhatHasBecomeCheapIsTakenAgain) {
  PageChoice choice;
  EXPECT_EQ(MapLarge(choice, 1, 4, 0.4), 1);
  EXPECT_FALSE(choice.TakesLarge(size_t{1} << 40));  // counts as long as it may
  EXPECT_EQ(MapLarge(choice, 100, 0.25, 0.4), 100);
}

TEST(PageChoiceTest, SmallPagesAreMeasuredOnlyWhereItMatters) {
  PageChoice choice;
  EXPECT_FALSE(choice.IsDear(0.5 * kMillisecond, []() -> double {
    ADD_FAILURE();
    return 0;
  }));
}

}  // namespace
}  // namespace wellspace::core
