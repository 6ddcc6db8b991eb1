// Contacts of segments in the plane with each other and with points, and the faults there.
#ifndef WELLSPACE_CORE_FEATURES_CROSSING_SEGMENTS_H_
#define WELLSPACE_CORE_FEATURES_CROSSING_SEGMENTS_H_

#include <algorithm>
#include <compare>
#include <cstdint>

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"

namespace wellspace::core {

// The side of the line from `a` to `b` that a point is on; exact.
inline Sign SideOf(const Point<2>& a, const Point<2>& b, const Point<2>& p) { return Orientation<2>({a, b, p}).sign; }

// Whether `p`, a point of the line through `a` and `b`, lies strictly between them.
inline bool IsBetween(const Point<2>& a, const Point<2>& b, const Point<2>& p) {
  return (a < p && p < b) || (b < p && p < a);
}

// Where two segments that cross do so, rounded. REQUIRES: {a, b} < {c, d}, a < b, and c < d, so that it does not depend
// on which comes first.
inline Point<2> CrossingFrom(const Point<2>& a, const Point<2>& b, const Point<2>& c, const Point<2>& d) {
  const Point<2> along = Difference<2>(b, a);
  const Point<2> other = Difference<2>(d, c);
  const Point<2> from = Difference<2>(c, a);
  const double determinant = Cross(along, other);
  const double t = determinant == 0 ? 0.5 : Cross(from, other) / determinant;
  const double at = std::clamp(t, 0.0, 1.0);
  return {a[0] + at * along[0], a[1] + at * along[1]};
}

// The fault between a segment and a point, or another segment.
struct Fault {
  enum class Kind : uint8_t { kOn, kNear, kCrossing, kNeedle };  // a needle: near, and joined to an end of the segment

  Kind kind = Kind::kOn;
  uint32_t segment = 0;  // of a crossing the lower of the two
  uint32_t other = 0;    // a point; of a crossing a segment

  auto operator<=>(const Fault&) const = default;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_CROSSING_SEGMENTS_H_
