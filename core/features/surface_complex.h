// A complex of triangles in space: the triangles of a surface once they are clean, and the edges that they share.
#ifndef WELLSPACE_CORE_FEATURES_SURFACE_COMPLEX_H_
#define WELLSPACE_CORE_FEATURES_SURFACE_COMPLEX_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_features.h"
#include "core/geometry/point.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {

// A side of a triangle: 3 t + k is that of triangle t from its corner k to the next one.
using TriangleSide = uint32_t;
constexpr TriangleSide SideOf(uint32_t triangle, uint32_t corner) { return 3 * triangle + corner; }
constexpr uint32_t TriangleOf(TriangleSide side) { return side / 3; }

// A given triangle, and a place on it.
struct PlacedTriangle {
  uint32_t source = 0;
  Point<3> at{};
};

// The changes on the way from the triangles that are given to a complex.
struct SurfaceCleaning {
  uint64_t equal_points = 0;     // beyond the first at each place
  uint64_t flat_triangles = 0;   // without an area, dropped
  uint64_t equal_triangles = 0;  // beyond the first over the same corners, dropped
  PlacedTriangle lowest_flat;    // at its least corner; if there is one
  PlacedTriangle lowest_equal;   // likewise
};

// Two equal triangles with different markers, by given triangle.
struct MarkerConflict {
  uint32_t one = 0;
  uint32_t other = 0;

  bool operator==(const MarkerConflict&) const = default;
};

// Invariants: (1) points are distinct, and ascend; (2) a triangle has an area, and begins with its least corner; no two
// have the same corners; they ascend by their sorted corners; (3) edges ascend, and so do the sides at each.
struct SurfaceComplex {
  std::vector<Point<3>> points;
  std::vector<uint32_t> point_of_input;            // by given point; kNoPoint: outside of the box of a BoxedSurface
  std::vector<std::array<uint32_t, 3>> triangles;  // corners, in the direction that is given
  std::vector<int32_t> markers;                    // by triangle
  std::vector<uint32_t> sources;                   // by triangle: the first given over its corners, or kNoSource
  std::vector<std::array<uint32_t, 2>> edges;      // the lower point first
  std::vector<uint32_t> first_side;                // by edge, and one more: where its sides begin in `sides`
  std::vector<TriangleSide> sides;
  std::vector<uint32_t> edge_of_side;
  SurfaceCleaning cleaning;
  std::vector<MarkerConflict> conflicts;  // ascending by the triangle; at most kMostConflicts
  uint64_t conflict_count = 0;

  static constexpr size_t kMostConflicts = 1000;
  static constexpr uint32_t kNoPoint = std::numeric_limits<uint32_t>::max();
  static constexpr uint32_t kNoSource = std::numeric_limits<uint32_t>::max();  // a side of the box of a BoxedSurface

  const Point<3>& Corner(uint32_t triangle, uint32_t k) const { return points[triangles[triangle][k]]; }
  Triangle TriangleAt(uint32_t triangle) const {
    return {Corner(triangle, 0), Corner(triangle, 1), Corner(triangle, 2)};
  }
  // The triangle as InOrder has it: points ascend.
  Triangle InOrderAt(uint32_t triangle) const {
    const std::array<uint32_t, 3>& corners = triangles[triangle];  // the least one first
    const auto [low, high] = std::minmax(corners[1], corners[2]);
    return {points[corners[0]], points[low], points[high]};
  }
  std::span<const TriangleSide> SidesAt(uint32_t edge) const {
    return {sides.data() + first_side[edge], first_side[edge + 1] - first_side[edge]};
  }
  // Whether a side runs from the lower point of its edge to the higher one.
  bool RunsUp(TriangleSide side) const {
    const std::array<uint32_t, 3>& corners = triangles[TriangleOf(side)];
    return corners[side % 3] < corners[(side + 1) % 3];
  }
  // The corner across from a side.
  uint32_t ApexOf(TriangleSide side) const { return triangles[TriangleOf(side)][(side + 2) % 3]; }
};

// Whether three points lie on a line; exact.
bool AreCollinear(const Point<3>& a, const Point<3>& b, const Point<3>& c);

// Makes a complex of the triangles of `features` over `points`, n x 3. `place_of` says for each given point, which the
// triangles name, which row of `points` it has become; empty: its own. Nothing is moved.
//
// REQUIRES:   coordinates are finite; place_of < n.
// Guarantees: (1) neither the order of triangles nor that of points, nor which corner comes first, changes a bit of the
//             result but for `point_of_input`, `sources` and `conflicts`, which have given numbers; (2) of equal
//             triangles with different markers the least marker is kept, and the conflict is told.
// Complexity: O((n + m) log (n + m)).
// Errors:     INVALID_ARGUMENT: a corner that is no point, naming the triangle; more triangles than can be numbered;
//             CANCELLED, DEADLINE_EXCEEDED.
// Source:     docs/design/surfaces.md.
absl::StatusOr<SurfaceComplex> MakeSurfaceComplex(std::span<const double> points, std::span<const uint32_t> place_of,
                                                  const SurfaceFeatures& features, const RunContext& context);

// The peak memory of MakeSurfaceComplex, beside its input. Unit: bytes.
uint64_t SurfaceComplexBytes(uint64_t points, uint64_t triangles);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SURFACE_COMPLEX_H_
