// Numbers that have to fit into a field.
#include "client/formats/io/number.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <string>

namespace wellspace::formats {
namespace {

std::string Within(double value, size_t width) {
  std::string text = "before ";
  const double read = AppendNumberWithin(value, width, text);
  text = text.substr(7);
  double parsed = 0;
  EXPECT_TRUE(ParseFinite(text, parsed).ok()) << text;
  EXPECT_EQ(std::bit_cast<uint64_t>(parsed), std::bit_cast<uint64_t>(read)) << text;
  EXPECT_LE(text.size(), width) << text;
  return text;
}

TEST(NumberTest, WholeNumbersThatNoDoubleIsAreTold) {
  const auto is_rounded = [](std::string_view text) {
    double value = 0;
    EXPECT_TRUE(ParseFinite(text, value).ok()) << text;
    return IsRoundedWhole(text, value);
  };
  for (const char* kept : {"0", "-0", "9007199254740992", "-9007199254740994", "0009007199254740992", "1e300",
                           "9007199254740993.0", "1152921504606846976", "100000000000000000000"}) {
    EXPECT_FALSE(is_rounded(kept)) << kept;
  }
  for (const char* rounded :
       {"9007199254740993", "-9007199254740993", "18446744073709551615", "123456789012345678901234567890"}) {
    EXPECT_TRUE(is_rounded(rounded)) << rounded;
  }
}

TEST(NumberTest, WhatFitsIsExactInItsShortestForm) {
  EXPECT_EQ(Within(0.5, 20), "0.5");
  EXPECT_EQ(Within(-0.0, 20), "-0");
  EXPECT_EQ(Within(1e300, 20), "1e+300");
  EXPECT_EQ(Within(-1234.5678901234567, 20), "-1234.5678901234567");
  // One or two characters too many as others write them.
  EXPECT_EQ(Within(8.708810636114117e-05, 20), "8.708810636114117e-5");
  EXPECT_EQ(Within(-8.70881063611417e-11, 21), "-8.70881063611417e-11");
  EXPECT_EQ(Within(-8.70881063611417e-11, 20), "-870881063611417e-25");
  EXPECT_EQ(Within(-0.012345678901234568, 20), "-.012345678901234568");
}

TEST(NumberTest, WhatDoesNotFitIsTheNearestOfItsDigits) {
  EXPECT_EQ(Within(1.2345678901234567e-5, 20), "1.234567890123457e-5");
  EXPECT_EQ(Within(-8.708810636114117e-05, 20), "-8.70881063611412e-5");
  EXPECT_EQ(Within(-1.2345678901234567e-105, 20), "-12345678901235e-118");
  // Rounded up, they would be infinite.
  const double largest = std::numeric_limits<double>::max();
  EXPECT_EQ(Within(largest, 20), "1797693134862315e293");
  EXPECT_EQ(Within(-largest, 20), "-179769313486231e294");
  EXPECT_EQ(Within(std::numeric_limits<double>::min(), 20), "22250738585072e-321");
}

TEST(NumberTest, EveryNumberOfAnySizeFits) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 200'000; ++i) {
    const double bits = std::bit_cast<double>(random());
    const double value =
        i % 2 == 0 ? bits : std::ldexp(static_cast<double>(random()), -static_cast<int>(random() % 90));
    if (!std::isfinite(value)) {
      continue;
    }
    std::string text;
    const double read = AppendNumberWithin(value, 20, text);
    ASSERT_LE(text.size(), 20) << text;
    ASSERT_LE(std::abs(read - value), 1e-13 * std::abs(value)) << text;
    double parsed = 0;
    ASSERT_TRUE(ParseFinite(text, parsed).ok() && parsed == read) << text;
  }
}

}  // namespace
}  // namespace wellspace::formats
