// Crossings of segments with triangles, with all ties broken for good.
#ifndef WELLSPACE_CORE_FEATURES_TRIANGLE_CROSSING_H_
#define WELLSPACE_CORE_FEATURES_TRIANGLE_CROSSING_H_

#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {

// Points are taken as moved by (e, e^2, e^3), for an e above zero and smaller than any number, while triangles stay. So
// no point is on the plane of a triangle, and a segment between two points meets no side of a triangle.

// On which side of the plane of a triangle `p` is: kPositive where orientation (a, b, c, p) is; never kZero.
//
// REQUIRES:   the triangle has an area; coordinates are finite.
// Guarantees: exact.
// Complexity: O(1).
Sign MovedSide(const Triangle& triangle, const Point<3>& p);

// kPositive if corners of `other` are on the positive side of the plane of `triangle` and none is on the other one,
// kNegative the other way round; kZero if there are some on both sides, or on none. Nothing is moved.
//
// Guarantees: exact.
// Complexity: O(1).
Sign SideOfCorners(const Triangle& triangle, const Triangle& other);

// Whether the segment from `p` to `q` crosses a triangle, when it is known on which side of the plane its ends are.
//
// REQUIRES:   as MovedSide; side_of_p and side_of_q are results of MovedSide.
// Guarantees: (1) exact; (2) of triangles around a common edge that a segment passes, either no two in turn are
//             crossed, or both: nothing leaks, and nothing is crossed twice.
// Complexity: O(1).
bool Crosses(const Triangle& triangle, const Point<3>& p, Sign side_of_p, const Point<3>& q, Sign side_of_q);

// Whether the segment from `p` to `q` crosses `one` before `other`, both of which it crosses; false if at once, which
// is where they overlap.
//
// REQUIRES:   as MovedSide; the segment crosses both.
// Guarantees: exact; a strict order of the triangles that a segment crosses.
// Complexity: O(1).
bool IsCrossedBefore(const Triangle& one, const Triangle& other, const Point<3>& p, const Point<3>& q);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_TRIANGLE_CROSSING_H_
