// The estimate of a mesh as a mesher hands it out.
#ifndef WELLSPACE_CORE_MESH_ESTIMATE_H_
#define WELLSPACE_CORE_MESH_ESTIMATE_H_

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/mesh.h"
#include "core/refine/criteria.h"
#include "core/refine/plane/planar_domain.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// What the mesh that refinement makes of `structure`, in `domain` if there is one, would take, without a repair of
// slivers.
//
// Complexity: that of EstimateSize.
// Errors:     FAILED_PRECONDITION once vertices have been inserted; those of EstimateSize.
template <int D>
absl::StatusOr<MeshEstimate> EstimateMeshOf(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria,
                                            const RunContext& context, const PlanarDomain* domain = nullptr);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_ESTIMATE_H_
