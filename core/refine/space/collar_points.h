// Points on the patches around an acute curve.
#ifndef WELLSPACE_CORE_REFINE_SPACE_COLLAR_POINTS_H_
#define WELLSPACE_CORE_REFINE_SPACE_COLLAR_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/point.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

// Collar points are so many times the lesser of two spacings away: the ball over a subsegment does not reach them.
inline constexpr double kCollarShare = 0.6;

// The collar points of a vertex on different patches are shifted along the curve against each other by this share of
// the lesser spacing, at most. Else two and two beside neighbours on the curve are a trapezoid, so on a circle; and
// where the curve bends it is not quite flat, and thin tetrahedra would be in it.
inline constexpr double kShiftShare = 0.1;

// The patches at a point of a curve, in the order of the sides of triangles there, and the ways into them, which are
// across the curve.
struct SidesAtPoint {
  Point<3> along{};
  std::vector<uint32_t> patches;
  std::vector<Point<3>> ways;  // unit vectors
};

// Complexity: O(log edges + sides).
SidesAtPoint SidesAt(const SpatialDomain& domain, uint32_t curve, double arc);

// Of the sides of `patch` the one whose way is nearest to `way`; their number if there is none.
size_t SideAlike(const SidesAtPoint& sides, uint32_t patch, const Point<3>& way);

// The point of `patch` at `radius` from `centre`, near `target`; where `along` is no null vector, across it. It is on
// the patch, up to rounding, and at that distance as far as the patch goes on.
//
// Complexity: that of a few NearestOnPatch.
Point<3> PointAround(const SpatialDomain& domain, uint32_t patch, const Point<3>& target, const Point<3>& centre,
                     double radius, const Point<3>& along);

// The point on side `i` at that distance from `at`, across the curve.
Point<3> PointAcross(const SpatialDomain& domain, const SidesAtPoint& sides, size_t i, const Point<3>& at,
                     double radius);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_COLLAR_POINTS_H_
