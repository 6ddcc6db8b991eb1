// The sizes that a surface itself asks for: by its curvature, and by the thickness of the solids that it bounds.
#ifndef WELLSPACE_CORE_INPUT_SURFACE_SIZES_H_
#define WELLSPACE_CORE_INPUT_SURFACE_SIZES_H_

#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/refine/size_tree.h"
#include "core/refine/sizing.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

// Lengths are on the scale of the computation.
struct SurfaceSizeDemands {
  double curvature_elements = 0;  // edges on a circle that is as curved as the surface; 0: any number
  double thickness_layers = 0;    // edges across a solid; 0: any number
  double min_size = 0;            // radii of curvature and thicknesses below this are noise, and ask for nothing
  double most_edge = std::numeric_limits<double>::infinity();  // longer edges are not allowed anyway
  double gradation = 0;                                        // the growth of sizes with the distance from samples
  uint64_t max_vertices = 0;

  bool IsNone() const { return curvature_elements == 0 && thickness_layers == 0; }
};

// Cuts the triangles at solids that are meshed into pieces no longer than the edges that they ask for, and puts a
// sample, a bound on the circumradii of tetrahedra, on each piece. A piece asks for edges of
// - 2 pi / (curvature_elements k), where its triangle has the curvature k: the larger principal one of the sum over its
//   edges within a patch, each of which curves the surface across it, by the angle between the two normals there over
//   the mean height of the two triangles;
// - t / thickness_layers, where t is the way from its centroid, along the normal into the solid, to the next triangle
//   that faces it.
// The size of a sample is CircumradiusOf the edge, less half of what sizes grow from there to the farthest corner.
//
// Guarantees: (1) neither the order of triangles nor that of points changes the set of samples by a bit.
// Complexity: O(m + s log m) for m triangles and s samples; of thickness, beside that, the triangles near the ways.
// Errors:     RESOURCE_EXHAUSTED with the payload kDemandsTooFine: a demand that takes more than `max_vertices`
//             vertices, and the number that fits; CANCELLED, DEADLINE_EXCEEDED; those of the context's lender, which is
//             asked for `held` bytes and the samples.
// Source:     docs/design/surfaces.md, sizes of the surface itself.
absl::StatusOr<std::vector<SizedPlace<Point<3>>>> FindSurfaceSizes(const SpatialDomain& domain,
                                                                   const SurfaceSizeDemands& demands, uint64_t held,
                                                                   const RunContext& context);

// About how many vertices facets take on the surface of the solids that are meshed, under bounds on their circumradii.
//
// Complexity: O(m + 1 / kLongestPiece^2) questions for sizes.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<double> FacetVertices(const SpatialDomain& domain, const SizeField<3>& sizes, double facet_radius,
                                     const RunContext& context);

// Along a longer piece of a triangle, relative to the diagonal of the surface, sizes may change unseen.
inline constexpr double kLongestPiece = 0.03;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SURFACE_SIZES_H_
