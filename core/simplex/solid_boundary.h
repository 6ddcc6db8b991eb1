// The boundary of a mesh in space whose tetrahedra lie in the solids of a surface, facet by facet.
#ifndef WELLSPACE_CORE_SIMPLEX_SOLID_BOUNDARY_H_
#define WELLSPACE_CORE_SIMPLEX_SOLID_BOUNDARY_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/simplex/boundary.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {

// A mesh of the box around a surface, or of the meshed solids alone.
struct SolidMesh {
  std::span<const double> points;       // n x 3, row-major
  std::span<const uint32_t> simplices;  // m x 4 indices of points, row-major
  std::span<const uint32_t> solid_of;   // m: the solid of each, as LabelSimplices has it
  std::span<const int32_t> region_of;   // by solid of the surface: above 0, or 0 for one that is not meshed
};

// The facets that bound solids.
struct SolidBoundary {
  HugeVector<uint32_t> facets;      // rows of 3 vertices, part after part
  std::vector<BoundaryPart> parts;  // by ascending tag: one for each marker of the triangles around meshed solids
  HugeVector<int32_t> vertex_tags;  // by vertex: the least tag of a facet that it is a vertex of, or kNoTag
};

// Finds the facets between two solids of which one is meshed, those that one meshed tetrahedron has alone, and those of
// membranes: of one meshed solid on both sides, where the segment between the labelled points of both sides crosses
// membranes an odd number of times.
//
// A facet has the marker of a triangle between the two solids on its sides: of those with a marker of which all three
// vertices are on triangles, the nearest to its middle. Where no triangle is between these two solids, it is one at
// either of them.
//
// REQUIRES:   tetrahedra are positively oriented, and a facet belongs to two of them or to one; labels are solids of
//             the surface of `index`, and points have the coordinates of its triangles.
// Guarantees: (1) each facet is there once. It belongs to the tetrahedron whose region is lower, of one region that
//             whose solid is lower, of one solid the first; that one is meshed; (2) its other vertex, put before
//             those of the facet, makes a positively oriented tetrahedron: seen from the other side a facet is
//             counterclockwise; (3) the facets with one solid on one side close it, but for membranes; (4) within a
//             part, facets come in the order of their tetrahedra; (5) neither the order of triangles nor that of points
//             changes a facet or its tag.
// Complexity: O(n + m), and O(log) of the triangles nearby for each facet where several markers are.
// Errors:     RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores; the result does not depend on them.
// Source:     docs/design/surfaces.md.
absl::StatusOr<SolidBoundary> FindSolidBoundary(const SolidMesh& mesh, const SurfaceIndex& index, int threads,
                                                const RunContext& context);

// The memory of FindSolidBoundary beside the mesh and the index, for so many points, tetrahedra and triangles, but for
// the facets. Unit: bytes.
uint64_t SolidBoundaryBytes(uint64_t points, uint64_t simplices, uint64_t triangles);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_SOLID_BOUNDARY_H_
