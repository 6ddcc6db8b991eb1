// The dimensions of typed tests.
#ifndef WELLSPACE_TESTS_SUPPORT_DIMENSIONS_H_
#define WELLSPACE_TESTS_SUPPORT_DIMENSIONS_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

namespace wellspace::test {

template <int N>
struct Dimension {
  static constexpr int kValue = N;
};

// All that the core is built for.
using AllDimensions = ::testing::Types<Dimension<2>, Dimension<3>, Dimension<4>, Dimension<5>, Dimension<6>>;

// The dimensions in which a cell is a Polygon or a Polyhedron, and the others.
using UpTo3 = ::testing::Types<Dimension<2>, Dimension<3>>;
using Above3 = ::testing::Types<Dimension<4>, Dimension<5>, Dimension<6>>;

// The dimensions in which whole meshes of a few points are small: in 5-D 260 vertices and more, in 6-D 700.
using UpTo4 = ::testing::Types<Dimension<2>, Dimension<3>, Dimension<4>>;
using UpTo5 = ::testing::Types<Dimension<2>, Dimension<3>, Dimension<4>, Dimension<5>>;

// Of values for 2-D, 3-D, ... the one for dimension D; the last one counts for all dimensions beyond.
template <int D, typename T, size_t N>
constexpr T ByDimension(const T (&values)[N]) {
  return values[std::min(static_cast<size_t>(D) - 2, N - 1)];
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_DIMENSIONS_H_
