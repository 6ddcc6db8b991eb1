// Polygons in space as triangles over their corners. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_SURFACE_CUT_POLYGON_H_
#define WELLSPACE_CLIENT_FORMATS_SURFACE_CUT_POLYGON_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"

namespace wellspace::formats {

// Corners of a polygon that is not convex, at most: cutting it may take their third power.
inline constexpr size_t kMostEars = 1024;

// Appends the triangles that a polygon is cut into, three indices each, in the direction of the polygon: a fan from its
// first corner if it is convex, otherwise ear by ear. It is looked at in the projection along the axis that is nearest
// to its normal.
//
// Shapes:     points: n x 3.
// REQUIRES:   corners are points, three or more.
// Guarantees: (1) an edge of the polygon is an edge of one triangle; (2) triangles have an area in the projection, but
//             for the one that stands for a polygon without an area.
// Complexity: O(n) if it is convex; otherwise O(n^2) for most, never more than O(n^3).
// Errors:     a message without a location: it crosses or touches itself, or has too many corners.
absl::Status CutPolygon(std::span<const double> points, std::span<const uint32_t> corners,
                        std::vector<uint32_t>& triangles);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SURFACE_CUT_POLYGON_H_
