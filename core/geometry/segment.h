// Segments of the plane, and the boxes that they meet.
#ifndef WELLSPACE_CORE_GEOMETRY_SEGMENT_H_
#define WELLSPACE_CORE_GEOMETRY_SEGMENT_H_

#include <algorithm>
#include <cmath>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Twice the area of the triangle of the two vectors, above 0 if b is counterclockwise from a; rounded.
inline double Cross(const Point<2>& a, const Point<2>& b) { return a[0] * b[1] - a[1] * b[0]; }

// How far along the segment from `a` to `b`, which has a length, the foot of `p` is, in its lengths.
inline double Along(const Point<2>& a, const Point<2>& b, const Point<2>& p) {
  const Point<2> along = Difference<2>(b, a);
  return Dot<2>(Difference<2>(p, a), along) / NormSq<2>(along);
}

// The distance of `p` from the segment from `a` to `b`.
inline double DistanceToSegment(const Point<2>& a, const Point<2>& b, const Point<2>& p) {
  const double t = std::clamp(Along(a, b, p), 0.0, 1.0);
  const Point<2> foot = t < 0.5 ? Point<2>{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])}
                                : Point<2>{b[0] + (1 - t) * (a[0] - b[0]), b[1] + (1 - t) * (a[1] - b[1])};
  return Distance<2>(foot, p);
}

// The box of two points.
inline Box<2> BoxOfEnds(const Point<2>& a, const Point<2>& b) {
  return {{std::min(a[0], b[0]), std::min(a[1], b[1])}, {std::max(a[0], b[0]), std::max(a[1], b[1])}};
}

// Whether the segment from `a` to `b` surely has no point in `box`, which has a little room around it for rounding
// errors.
inline bool SurelyMisses(const Point<2>& a, const Point<2>& b, const Box<2>& box) {
  const Box<2> own = BoxOfEnds(a, b);
  if (own.low[0] > box.high[0] || own.high[0] < box.low[0] || own.low[1] > box.high[1] || own.high[1] < box.low[1]) {
    return true;
  }
  // The corners of the box lie on one side of the line, and farther from it than rounding errors.
  const Point<2> along = Difference<2>(b, a);
  const Point<2> centre = {0.5 * (box.low[0] + box.high[0]) - a[0], 0.5 * (box.low[1] + box.high[1]) - a[1]};
  const double half_x = 0.5 * (box.high[0] - box.low[0]);
  const double half_y = 0.5 * (box.high[1] - box.low[1]);
  const double away = std::abs(Cross(along, centre));
  const double size = std::abs(along[0]) * half_y + std::abs(along[1]) * half_x;
  const double rounding = 0x1p-48 * (std::abs(along[0] * centre[1]) + std::abs(along[1] * centre[0]) + size);
  return away > size + rounding;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_SEGMENT_H_
