// What every mesher refuses.
#ifndef WELLSPACE_CORE_MESHER_CHECKS_H_
#define WELLSPACE_CORE_MESHER_CHECKS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "core/mesh.h"
#include "core/mesh_parameters.h"

namespace wellspace::core {

// Leaves that the tree may have for each vertex of the budget; around isolated close pairs balance costs up to about
// two.
inline constexpr uint64_t kLeavesPerVertex = 8;

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

#endif  // WELLSPACE_CORE_MESHER_CHECKS_H_
