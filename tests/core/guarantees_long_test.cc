// The guarantees of docs/design/guarantees.md on larger clouds, for more seeds.
#include <gtest/gtest.h>

#include <string_view>

#include "tests/core/guarantee_runs.h"
#include "tests/support/seeded_test.h"

namespace wellspace::test {
namespace {

template <typename T>
class GuaranteesLongTest : public test::SeededTest {
 protected:
  GuaranteesLongTest() : SeededTest(1995) {}
};
TYPED_TEST_SUITE(GuaranteesLongTest, Dimensions);

TYPED_TEST(GuaranteesLongTest, AtEveryInsertion) {
  constexpr int D = TypeParam::kValue;
  for (const core::Criterion criterion : kCriteria) {
    for (const std::string_view shape : kShapes) {
      ExpectGuaranteesOfAll<D>(criterion, shape, LeastRho<D>(), D == 2 ? 30 : 9, this->seed_);
      ExpectGuaranteesOfAll<D>(criterion, shape, 1.1 * LeastRho<D>(), D == 2 ? 30 : 9, this->seed_ + 1);
    }
  }
}

TYPED_TEST(GuaranteesLongTest, Ends) {
  constexpr int D = TypeParam::kValue;
  for (uint64_t seed = this->seed_; seed < this->seed_ + 3; ++seed) {
    for (const std::string_view shape : kShapes) {
      for (const core::Criterion criterion : kCriteria) {
        ExpectItEnds<D>(criterion, LeastRho<D>(), D == 2 ? 200 : 40, seed, shape);
        ASSERT_FALSE(this->HasFatalFailure());
      }
    }
  }
}

}  // namespace
}  // namespace wellspace::test
