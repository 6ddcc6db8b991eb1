// Which boxes of space segments and triangles surely miss. Private to core/features.
#ifndef WELLSPACE_CORE_FEATURES_BOX_MISSES_H_
#define WELLSPACE_CORE_FEATURES_BOX_MISSES_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {

// What is rounded of coordinates in a box, and much more; a share of them.
inline constexpr double kBoxRoom = 0x1p-45;

// Whether a segment surely has no point in a box.
inline bool SideMisses(const Point<3>& a, const Point<3>& b, const Box<3>& box) {
  double from = 0;
  double to = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = b[axis] - a[axis];
    if (along == 0) {
      if (a[axis] < box.low[axis] || a[axis] > box.high[axis]) {
        return true;
      }
      continue;
    }
    const double at_low = (box.low[axis] - a[axis]) / along;
    const double at_high = (box.high[axis] - a[axis]) / along;
    from = std::max(from, std::min(at_low, at_high));
    to = std::min(to, std::max(at_low, at_high));
  }
  return from > to + 0x1p-40 * (1 + std::abs(from) + std::abs(to));
}

// Whether a triangle surely has no point in a box: the box lies on one side of its plane, or of a plane along one of
// its sides and across it.
inline bool TriangleMisses(const std::array<Point<3>, 3>& triangle, const Box<3>& box) {
  const Point<3>& a = triangle[0];
  const Point<3> normal = Cross(Difference<3>(triangle[1], a), Difference<3>(triangle[2], a));
  const auto is_beyond = [&](const Point<3>& out, const Point<3>& from, bool both_ways) {
    double middle = 0;
    double half = 0;
    double magnitude = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double centre = 0.5 * (box.low[axis] + box.high[axis]) - from[axis];
      middle += out[axis] * centre;
      half += std::abs(out[axis]) * 0.5 * (box.high[axis] - box.low[axis]);
      magnitude += std::abs(out[axis]) * (std::abs(centre) + std::abs(from[axis]));
    }
    const double room = half + kBoxRoom * (magnitude + half);
    return middle > room || (both_ways && -middle > room);
  };
  if (is_beyond(normal, a, /*both_ways=*/true)) {
    return true;
  }
  for (size_t k = 0; k < 3; ++k) {
    const Point<3> side = Difference<3>(triangle[(k + 1) % 3], triangle[k]);
    if (is_beyond(Cross(side, normal), triangle[k], /*both_ways=*/false)) {
      return true;
    }
  }
  return false;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_BOX_MISSES_H_
