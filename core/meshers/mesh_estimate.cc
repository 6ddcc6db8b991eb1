#include "core/meshers/mesh_estimate.h"

#include <algorithm>
#include <cmath>

#include "core/base/dimensions.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/estimate/estimate.h"

namespace wellspace::core {
namespace {

// A point nearer to a periodic side than so many times the distance to its nearest neighbour wants vertices there,
// graded from one of these distances to the other, and their images ask for others across: in all so many for each
// place where it has an image, and each halving of the distance. Fitted, see docs/design/estimate.md.
constexpr double kImageReach = 2;
template <int D>
constexpr double kVerticesPerImage = D == 2 ? 0.5 : 1.2;

}  // namespace

template <int D>
absl::StatusOr<MeshEstimate> EstimateMeshOf(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria,
                                            const RunContext& context, const EstimateEffort& effort,
                                            const PlanarDomain* frame) {
  if (structure.vertex_count() > structure.built_count()) {
    return absl::FailedPreconditionError(
        "vertices have been inserted since the mesher was created; an estimate is made before that");
  }
  WELLSPACE_ASSIGN_OR_RETURN(const SizeEstimate size, EstimateSize<D>(structure, criteria, context, effort, frame));
  return MeshEstimateOf<D>(structure, size);
}

template <int D>
MeshEstimate MeshEstimateOf(const QueryStructure<D>& structure, const SizeEstimate& size) {
  MeshEstimate estimate;
  estimate.vertices = SaturatedCount(size.vertices);
  estimate.simplices = SaturatedCount(size.simplices);
  estimate.memory_bytes = SaturatedCount(size.bytes);
  estimate.bytes_per_vertex = size.bytes / size.vertices;
  estimate.tree_leaves = structure.tree().leaf_count();
  return estimate;
}

template <int D>
absl::Status AddImages(const QueryStructure<D>& structure, const PeriodicBox<D>& periodic, const RunContext& context,
                       MeshEstimate& estimate) {
  Workspace<D> workspace;
  double halvings = 0;
  for (uint32_t v = 0; v < structure.built_count(); ++v) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const double nearest_sq = structure.NearestNeighbor(VertexId{v}, workspace).distance_sq;
    const double reach_sq = kImageReach * kImageReach * nearest_sq;
    int axes = 0;
    double least_sq = reach_sq;
    for (int axis = 0; axis < D; ++axis) {
      const int low = FaceIndex(axis, false);
      const double distance = std::min(structure.box().DistanceToFace(structure.point(VertexId{v}), low),
                                       structure.box().DistanceToFace(structure.point(VertexId{v}), low + 1));
      if ((periodic.faces() >> low & 1) != 0 && distance > 0 && distance * distance < reach_sq) {
        ++axes;
        least_sq = std::min(least_sq, distance * distance);
      }
    }
    halvings += ((1 << axes) - 1) * 0.5 * std::log2(reach_sq / least_sq);
  }
  const double added = kVerticesPerImage<D> * halvings;
  const double share = added / static_cast<double>(std::max<uint64_t>(estimate.vertices, 1));
  const auto grow = [](uint64_t& figure, double by) { figure = SaturatedCount(static_cast<double>(figure) + by); };
  grow(estimate.simplices, share * static_cast<double>(estimate.simplices));
  grow(estimate.vertices, added);
  grow(estimate.memory_bytes, added * estimate.bytes_per_vertex);
  return absl::OkStatus();
}

#define WELLSPACE_INSTANTIATE(D)                                                                            \
  template absl::StatusOr<MeshEstimate> EstimateMeshOf<D>(const QueryStructure<D>&, const MeshCriteria<D>&, \
                                                          const RunContext&, const EstimateEffort&,         \
                                                          const PlanarDomain*);                             \
  template MeshEstimate MeshEstimateOf<D>(const QueryStructure<D>&, const SizeEstimate&);                   \
  template absl::Status AddImages<D>(const QueryStructure<D>&, const PeriodicBox<D>&, const RunContext&, MeshEstimate&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
