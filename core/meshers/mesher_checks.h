// The checks that all meshers share: demands and calls that they refuse, and memory that they ask for.
#ifndef WELLSPACE_CORE_MESHERS_MESHER_CHECKS_H_
#define WELLSPACE_CORE_MESHERS_MESHER_CHECKS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/input/mesh_parameters.h"
#include "core/input/scaled_samples.h"
#include "core/mesh/mesh.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// Memory of building the tree, for each point, but for the most uneven clouds: keys, the point twice, a place in a
// split leaf, indices. Unit: bytes.
template <int D>
constexpr uint64_t kTreeBytes =
    2 * sizeof(Point<D>) + sizeof(uint64_t) * D + 24 +
    LeafTree<D>::VertexPool::BytesFor(LeafTree<D>::kLeafCapacity / LeafTree<D>::kChildren) * LeafTree<D>::kChildren
        / LeafTree<D>::kLeafCapacity;

// Reserves the memory of building a mesher before its first array is made: so many bytes for each of `points`, for
// `others`, and for the samples of `parameters`.
//
// Errors:     those of the context's lender.
template <int D>
absl::Status ReserveForBuilding(const MeshParameters& parameters, uint64_t points, uint64_t bytes_per_point,
                                uint64_t others, const RunContext& context) {
  constexpr uint64_t kFixedBytes = uint64_t{4} << 20;
  return context.ReserveMemory(kFixedBytes + points * bytes_per_point + others +
                               ScaledSamples<D>::BytesFor(parameters));
}

// Asks for the memory of the samples of `parameters`, beside `held` bytes, unless `taken` has them.
//
// Errors:     those of the context's lender.
template <int D>
absl::Status AllowSamples(const MeshParameters& parameters, const ScaledSamples<D>& taken, uint64_t held,
                          const RunContext& context) {
  return parameters.size_samples == nullptr || taken.Has(parameters)
             ? absl::OkStatus()
             : context.AllowMemory(held + ScaledSamples<D>::BytesFor(parameters));
}

// Refuses parameters that are not valid, or not those of a mesh in `dimension`.
//
// Errors:     INVALID_ARGUMENT, naming the field.
absl::Status CheckParametersIn(const MeshParameters& parameters, int dimension);

// Refuses to extract a mesh unless it is refined; `threads` are to do it.
//
// Errors:     FAILED_PRECONDITION; those of CheckThreads.
absl::Status CheckRefined(bool is_refined, int threads);

// Refuses a mesh that is not the last which was extracted, as far as its figures tell.
//
// Errors:     INVALID_ARGUMENT with the figures of both.
absl::Status CheckLastMesh(const Mesh& mesh, int dimension, uint64_t vertices, uint64_t simplices);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_MESHER_CHECKS_H_
