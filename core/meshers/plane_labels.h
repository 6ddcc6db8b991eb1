// The labels of a mesh in a domain of the plane: origins, facets, tags, regions. PlaneMesher writes them in each mesh.
#ifndef WELLSPACE_CORE_MESHERS_PLANE_LABELS_H_
#define WELLSPACE_CORE_MESHERS_PLANE_LABELS_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/input/vertex_numbering.h"
#include "core/mesh/mesh.h"
#include "core/refine/plane/planar_domain.h"

namespace wellspace::core {

// Sets where vertices come from: inputs, corners of the box, and the refinement.
//
// Complexity: O(vertices).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::Status SetOrigins(const PlanarDomain& planar, const VertexNumbering<2>& numbering, Mesh& mesh,
                        const RunContext& context);

// Sets the facets: the subsegments of `chains`, in parts by marker or side of the box; and the tags of their
// vertices. The meshed part is on the left of a facet that bounds it.
//
// Complexity: O(vertices + segments log segments).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::Status SetBoundary(const PlanarDomain& planar, const PlanarDomain::Chains& chains,
                         const VertexNumbering<2>& numbering, Mesh& mesh, const RunContext& context);

// Sets the regions, and that of each triangle, which is its face's; `faces_of` has the face of each.
//
// Complexity: O(triangles log regions).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::Status SetRegions(const PlanarDomain& planar, std::span<const uint32_t> faces_of, Mesh& mesh,
                        const RunContext& context);

// How many triangles break rho.
//
// Complexity: O(triangles).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<uint64_t> CountExempt(const Mesh& mesh, double rho, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_PLANE_LABELS_H_
