// A triangulation of points in the plane that has given segments for edges.
#ifndef WELLSPACE_CORE_FEATURES_PLANE_TRIANGULATION_H_
#define WELLSPACE_CORE_FEATURES_PLANE_TRIANGULATION_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/segment_pairs.h"
#include "core/geometry/point.h"

namespace wellspace::core {

struct PlaneTriangulation {
  std::vector<std::array<uint32_t, 3>> triangles;  // of points, counterclockwise
  // Two segments meet in another place than a common end, or a point lies on one. Then there are no triangles.
  bool do_meet = false;
};

// Triangulates the convex hull of `points`. Each point is a corner, and each segment an edge. Else the triangles are
// Delaunay: points that lie on a line but for rounding have no triangle of their own.
//
// REQUIRES:   points are distinct, and ascend; the ends of a segment are two points, and no two segments have the same.
// Guarantees: (1) each triangle has an area, and no two overlap; together they cover the hull; (2) no corner
//             of a triangle is in the circumcircle of a neighbour, unless a segment parts them, or that takes more than
//             64 looks a side, as on some convex curves of 10^5 points; (3) the order of segments changes nothing.
// Complexity: O((n + m) log (n + m)). Signs are exact.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Source:     Hertel, Mehlhorn: Fast triangulation of the plane with respect to simple polygons, 1985: a sweep that
//             keeps, between two segments that it crosses, the border of what it has triangulated there. Shamos, Hoey:
//             Geometric intersection problems, 1976: segments that meet are neighbours in the sweep before. Lawson:
//             Software for C1 surface interpolation, 1977: flips.
absl::StatusOr<PlaneTriangulation> TriangulatePlane(std::span<const Point<2>> points,
                                                    std::span<const SegmentEnds> segments, const RunContext& context);

// The memory of TriangulatePlane, with its result. Unit: bytes.
uint64_t PlaneTriangulationBytes(uint64_t points, uint64_t segments);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_PLANE_TRIANGULATION_H_
