// The dimensions of typed tests.
#ifndef WELLSPACE_TESTS_SUPPORT_DIMENSIONS_H_
#define WELLSPACE_TESTS_SUPPORT_DIMENSIONS_H_

#include <gtest/gtest.h>

namespace wellspace::test {

template <int N>
struct Dimension {
  static constexpr int kValue = N;
};

// All that the core is built for.
using AllDimensions = ::testing::Types<Dimension<2>, Dimension<3>, Dimension<4>, Dimension<5>, Dimension<6>>;

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_DIMENSIONS_H_
