// A fixture for tests that draw.
#ifndef WELLSPACE_TESTS_SUPPORT_SEEDED_TEST_H_
#define WELLSPACE_TESTS_SUPPORT_SEEDED_TEST_H_

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "tests/support/clouds.h"

namespace wellspace::test {

// All that a test draws follows from one seed, Seed(fixed), which failures print.
class SeededTest : public ::testing::Test {
 protected:
  explicit SeededTest(uint64_t fixed)
      : seed_(Seed(fixed)), random_(seed_), trace_(__FILE__, __LINE__, "seed " + std::to_string(seed_)) {}

  const uint64_t seed_;
  SplitMix64 random_;

 private:
  const ::testing::ScopedTrace trace_;
};

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_SEEDED_TEST_H_
