// The order of half-planes around a line. Private to core/features.
#ifndef WELLSPACE_CORE_FEATURES_ANGLE_ORDER_H_
#define WELLSPACE_CORE_FEATURES_ANGLE_ORDER_H_

#include "core/geometry/point.h"

namespace wellspace::core {

// Orders half-planes that end in the line from `a` to `b` by their angles around it, counterclockwise for an observer
// who looks along it from b to a; each is given by a point of it. The first is the one of `from`. Exact.
//
// Thread safety: thread-safe.
class AngleOrder {
 public:
  // REQUIRES:   a, b and from are on no line, and neither is any other point with a and b.
  AngleOrder(const Point<3>& a, const Point<3>& b, const Point<3>& from) : a_(a), b_(b), from_(from) {}

  // Whether the half-plane of `p` comes before that of `q`; false where they are one.
  bool operator()(const Point<3>& p, const Point<3>& q) const;

 private:
  int QuarterOf(const Point<3>& p) const;

  const Point<3> a_;
  const Point<3> b_;
  const Point<3> from_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_ANGLE_ORDER_H_
