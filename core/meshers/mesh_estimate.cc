#include "core/meshers/mesh_estimate.h"

#include "core/base/dimensions.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/estimate/estimate.h"

namespace wellspace::core {

template <int D>
absl::StatusOr<MeshEstimate> EstimateMeshOf(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria,
                                            const RunContext& context, const PlanarDomain* frame) {
  if (structure.vertex_count() > structure.built_count()) {
    return absl::FailedPreconditionError(
        "vertices have been inserted since the mesher was created; an estimate is made before that");
  }
  WELLSPACE_ASSIGN_OR_RETURN(const SizeEstimate size, EstimateSize<D>(structure, criteria, context, {}, frame));
  MeshEstimate estimate;
  estimate.vertices = SaturatedCount(size.vertices);
  estimate.simplices = SaturatedCount(size.simplices);
  estimate.memory_bytes = SaturatedCount(size.bytes);
  estimate.bytes_per_vertex = size.bytes / size.vertices;
  estimate.tree_leaves = structure.tree().leaf_count();
  return estimate;
}

#define WELLSPACE_INSTANTIATE(D)                                                                            \
  template absl::StatusOr<MeshEstimate> EstimateMeshOf<D>(const QueryStructure<D>&, const MeshCriteria<D>&, \
                                                          const RunContext&, const PlanarDomain*);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
