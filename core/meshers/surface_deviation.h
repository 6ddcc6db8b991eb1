// Distances between the facets of a mesh and the surface that they stand for. SpaceMesher sets statistics by them, and
// adds vertices where the surface is too far from all facets.
#ifndef WELLSPACE_CORE_MESHERS_SURFACE_DEVIATION_H_
#define WELLSPACE_CORE_MESHERS_SURFACE_DEVIATION_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/refine/space/spatial_domain.h"
#include "core/tree/morton.h"

namespace wellspace::core {

// A sample of the surface that is farther from all facets than it may be.
struct FarSample {
  Point<3> at{};
  uint32_t patch = 0;
  double distance = 0;  // to the nearest facet
};

// How far the surface is from the facets.
struct SurfaceDeviation {
  double largest = 0;            // the largest distance of a sample from the nearest facet
  std::vector<FarSample> far{};  // of each triangle the farthest sample, if it is farther than the limit
};

// The largest distance of samples of facets from the surface: of their middles, corners and the middles of their sides.
//
// Shapes:     points: n x 3, row-major, on the scale of the computation; facets: m x 3 indices of them.
// Guarantees: (1) the order of facets and points changes nothing.
// Complexity: O(m log triangles).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<double> DeviationOfFacets(const SpatialDomain& domain, std::span<const double> points,
                                         std::span<const uint32_t> facets, const RunContext& context);

// How far samples of the surface are from facets: of triangles around solids that are meshed their middles, and more
// where they are large. The largest distance is right even if it is no more than the limit.
//
// Shapes:     as DeviationOfFacets.
// REQUIRES:   there are facets, which meet in common corners and sides alone.
// Guarantees: (1) the order of facets and points changes nothing.
// Complexity: O(samples log m).
// Errors:     CANCELLED, DEADLINE_EXCEEDED; RESOURCE_EXHAUSTED of the context's memory.
// Source:     docs/design/surfaces.md.
absl::StatusOr<SurfaceDeviation> DeviationOfSurface(const SpatialDomain& domain, std::span<const double> points,
                                                    std::span<const uint32_t> facets, double limit,
                                                    const MortonGrid<3>& grid, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_SURFACE_DEVIATION_H_
