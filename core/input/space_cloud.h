// Triangles and points of a domain in space, on their way into the query structure.
#ifndef WELLSPACE_CORE_INPUT_SPACE_CLOUD_H_
#define WELLSPACE_CORE_INPUT_SPACE_CLOUD_H_

#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_features.h"
#include "core/geometry/box.h"
#include "core/input/frame.h"
#include "core/input/sorted_cloud.h"
#include "core/input/surface_report.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

// The report of the preparation of a surface, and the numbers of solids, points and seeds that it has found.
struct SpaceFigures {
  SurfaceReport report;
  uint64_t solids = 0;          // that are meshed
  uint64_t dropped_points = 0;  // given ones on no triangle, and in no solid that is meshed
  uint64_t unused_seeds = 0;    // points of holes and regions in solids that the rule does not mesh
  uint64_t first_unused_seed = 0;
};

// The surface, with the first vertices on it, and the points in solids that are meshed.
struct SpaceCloud {
  Frame<3> frame;        // its box holds all points with room around them, and bounds nothing
  SortedCloud<3> cloud;  // of the first vertices
  PointNames names;      // of the sorted points; of inputs that are no vertices kNoOutput
  std::unique_ptr<SpatialDomain> domain;
  Box<3> meshed_box;  // of the meshed solids, not scaled
  SpaceFigures figures;
};

// Peak memory of MakeSpaceCloud beside its arguments, for so many points and triangles; `welds`: a length for welding
// is given. Unit: bytes.
uint64_t SpaceCloudBytes(uint64_t points, uint64_t triangles, bool welds);

// Prepares the surface of `features`, refuses one with faults, finds which solids are meshed and their regions, and
// puts the first vertices on the surface: in all corners; along curves, about `curve_edge` from each other, and three
// on a loop at least; around acute curves and corners as SampleCreases says, no farther from their curves than
// `tolerance`, 0 for the default; and eight on each patch that no curve bounds.
//
// Shapes:     points: n x 3, row-major.
// Guarantees: (1) neither the order of triangles nor that of points, nor the number of threads, changes a bit but for
//             the numbers of points.
// Complexity: that of PrepareSurface, and of SurfaceIndex::Build.
// Errors:     those of PrepareSurface; INVALID_ARGUMENT for its faults, in its words, with the first place; where two
//             patches or curves meet at less than kLeastAngle; where nothing is meshed; for a point too near to the
//             surface; those of SortCloud; those of the context's memory; RESOURCE_EXHAUSTED for more first vertices
//             than `max_vertices`.
absl::StatusOr<SpaceCloud> MakeSpaceCloud(std::span<const double> points, const SurfaceFeatures& features,
                                          double curve_edge, double tolerance, uint64_t max_vertices, int threads,
                                          const RunContext& context);

// The smallest angle between patches at a curve, and between curves in a corner. Unit: degrees.
inline constexpr double kLeastAngle = 5;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SPACE_CLOUD_H_
