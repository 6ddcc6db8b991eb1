#include "core/meshers/mesher_checks.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

absl::Status CheckParametersIn(const MeshParameters& parameters, int dimension) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  if (parameters.dimension != dimension) {
    return absl::InvalidArgumentError(
        absl::StrCat("dimension: ", parameters.dimension, " is not that of the mesh, ", dimension));
  }
  return absl::OkStatus();
}

absl::Status CheckRefined(bool is_refined, int threads) {
  if (!is_refined) {
    return absl::FailedPreconditionError(
        "the mesh has not been refined since vertices were last added; refine it first");
  }
  return CheckThreads(threads);
}

absl::Status CheckLastMesh(const Mesh& mesh, int dimension, uint64_t vertices, uint64_t simplices) {
  if (mesh.dimension != dimension || mesh.vertex_count() != vertices || mesh.simplex_count() != simplices) {
    return absl::InvalidArgumentError(absl::StrCat("mesh: it has ", mesh.vertex_count(), " vertices and ",
                                                   mesh.simplex_count(), " simplices in ", mesh.dimension,
                                                   "-D; the last that was extracted has ", vertices, " and ", simplices,
                                                   " in ", dimension, "-D, and only that can be updated"));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
