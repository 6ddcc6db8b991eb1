// The estimate of a mesh as a mesher hands it out.
#ifndef WELLSPACE_CORE_MESHERS_MESH_ESTIMATE_H_
#define WELLSPACE_CORE_MESHERS_MESH_ESTIMATE_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/base/saturate.h"
#include "core/estimate/estimate.h"
#include "core/geometry/periodic_box.h"
#include "core/mesh/mesh.h"
#include "core/refine/criteria.h"
#include "core/refine/plane/planar_domain.h"
#include "core/sliver/sliver_stage.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The estimate of the mesh that refinement makes of `structure`, in the domain `frame` if there is one, without repair
// of slivers.
//
// Complexity: that of EstimateSize.
// Errors:     FAILED_PRECONDITION once vertices have been inserted; those of EstimateSize.
template <int D>
absl::StatusOr<MeshEstimate> EstimateMeshOf(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria,
                                            const RunContext& context, const EstimateEffort& effort = {},
                                            const PlanarDomain* frame = nullptr);
// As a mesher hands out this size, of a mesh of `structure`.
template <int D>
MeshEstimate MeshEstimateOf(const QueryStructure<D>& structure, const SizeEstimate& size);

// Adds the memory for the repair of slivers, or for pumping, to the estimate of a mesh.
template <int D>
void AddSliverStage(MeshEstimate& estimate) {
  const uint64_t bytes = SliverStage<D>::EstimateBytes(estimate.vertices, estimate.simplices);
  estimate.memory_bytes = SaturatedCount(static_cast<double>(estimate.memory_bytes) + static_cast<double>(bytes));
  estimate.bytes_per_vertex += static_cast<double>(bytes) / static_cast<double>(estimate.vertices);
}

// Adds to an estimate the vertices that a periodic box has beside those of another: the images of vertices on its
// sides, and what they ask for around them. Sizes are not looked at.
//
// REQUIRES:   no vertex has been inserted yet.
// Complexity: one query a vertex.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::Status AddImages(const QueryStructure<D>& structure, const PeriodicBox<D>& periodic, const RunContext& context,
                       MeshEstimate& estimate);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_MESH_ESTIMATE_H_
