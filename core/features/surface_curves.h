// The curves of a surface, where it has creases, ends or branches; their corners; and the patches between them.
#ifndef WELLSPACE_CORE_FEATURES_SURFACE_CURVES_H_
#define WELLSPACE_CORE_FEATURES_SURFACE_CURVES_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_complex.h"

namespace wellspace::core {

// Invariants: (1) two triangles at an edge on no curve are of one patch; (2) an edge is on one curve at most; (3)
// curves meet in corners alone.
struct SurfaceCurves {
  std::vector<uint32_t> patch_of;  // by triangle; patches are numbered by their first triangles
  uint32_t patch_count = 0;
  std::vector<uint32_t> corners;      // points, ascending
  std::vector<uint32_t> first_point;  // by curve, and one more: where its points begin in `points`
  std::vector<uint32_t> points;       // of curves, along each; a loop has its first point once more at its end

  size_t curve_count() const { return first_point.empty() ? 0 : first_point.size() - 1; }
  std::span<const uint32_t> PointsOf(size_t curve) const {
    return {points.data() + first_point[curve], first_point[curve + 1] - first_point[curve]};
  }
};

// The angle between the normals of the two triangles at an edge, from 0 where the surface is flat there to 180 where
// they lie on each other, whichever way each of them goes.
//
// Units:      degrees.
// REQUIRES:   the edge has two triangles.
double CreaseAngle(const SurfaceComplex& complex, uint32_t edge);

// Finds curves: edges with another number of triangles than two, with two markers, or with a crease angle above
// `crease_angle`. Patches with an area below the square of `min_patch` then join a neighbour, the smallest first. It is
// the one with which they have the longest weak crease in common, below 60 degrees and without a change of markers.
// Edges whose two triangles are of one patch are dropped: fragments of creases, such as thin triangles make by chance.
// But where their normals are more than 120 degrees apart they stay, if so many of them hang together that they are
// five times as long as `min_patch`: a patch may go around, as that of a wing.
//
// Corners are where curves end or branch, where one turns by more than 40 degrees, and where it comes between other
// patches; and the tips of cones, points on no curve around which the triangles have less than 300 degrees.
//
// A curve leads from its lower corner to the other one; a loop without corners from its lowest point towards the lower
// neighbour. Curves ascend by their points.
//
// REQUIRES:   crease_angle in [0, 180], degrees; min_patch >= 0, a length.
// Guarantees: (1) neither the order of triangles nor that of points changes a bit of the result.
// Complexity: O(m log m).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Source:     docs/design/surfaces.md, where it says why patches decide, and not angles alone.
absl::StatusOr<SurfaceCurves> FindCurves(const SurfaceComplex& complex, double crease_angle, double min_patch,
                                         const RunContext& context);

// The peak memory of FindCurves. Unit: bytes.
uint64_t SurfaceCurvesBytes(uint64_t points, uint64_t triangles);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SURFACE_CURVES_H_
