// The effect of rounding on the comparisons of the refinement: on nodes that are watched, and on the assertions of the
// checking build.
#ifndef WELLSPACE_CORE_REFINE_ROUNDING_H_
#define WELLSPACE_CORE_REFINE_ROUNDING_H_

#include <algorithm>
#include <cmath>

#include "core/geometry/box.h"

namespace wellspace::core {

// To lengths, relatively; to coordinates, relative to the largest.
inline constexpr double kLengthRounding = 1e-9;
inline constexpr double kCoordinateRounding = 0x1p-49;
// A search within a reach goes so much farther, so that rounding leaves out nothing within it.
inline constexpr double kBeyond = 1 + kLengthRounding;

// To a coordinate.
template <int D>
double RoundingIn(const Box<D>& box) {
  double largest = 0;
  for (int i = 0; i < D; ++i) {
    largest = std::max({largest, std::abs(box.low[i]), std::abs(box.high[i])});
  }
  return kCoordinateRounding * largest;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_ROUNDING_H_
