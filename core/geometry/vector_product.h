// The vector product of R^3, and angles between vectors.
#ifndef WELLSPACE_CORE_GEOMETRY_VECTOR_PRODUCT_H_
#define WELLSPACE_CORE_GEOMETRY_VECTOR_PRODUCT_H_

#include <cmath>
#include <numbers>

#include "core/geometry/point.h"

namespace wellspace::core {

inline Point<3> Cross(const Point<3>& a, const Point<3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The angle between two vectors, from 0 to 180. Unit: degrees.
inline double AngleBetween(const Point<3>& a, const Point<3>& b) {
  return std::atan2(std::sqrt(NormSq<3>(Cross(a, b))), Dot<3>(a, b)) * (180 / std::numbers::pi);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_VECTOR_PRODUCT_H_
