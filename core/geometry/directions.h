// Vectors by their directions: the component of one across another, and vectors of length 1.
#ifndef WELLSPACE_CORE_GEOMETRY_DIRECTIONS_H_
#define WELLSPACE_CORE_GEOMETRY_DIRECTIONS_H_

#include <cmath>

#include "core/geometry/point.h"

namespace wellspace::core {

// The component of `v` perpendicular to `along`.
inline Point<3> Across(const Point<3>& v, const Point<3>& along) {
  const double t = Dot<3>(v, along) / NormSq<3>(along);
  return {v[0] - t * along[0], v[1] - t * along[1], v[2] - t * along[2]};
}

// The vector of length 1 in the direction of `v`; rounded.
inline Point<3> Unit(const Point<3>& v) {
  const double length = std::sqrt(NormSq<3>(v));
  return {v[0] / length, v[1] / length, v[2] / length};
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_DIRECTIONS_H_
