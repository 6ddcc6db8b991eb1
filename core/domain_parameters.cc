#include "core/domain_parameters.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

absl::Status ValidateDomainParameters(const MeshParameters& parameters, const Features& features) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  if (parameters.dimension != 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("dimension: segments bound domains in 2-D alone, and it is ", parameters.dimension));
  }
  if (parameters.criterion != Criterion::kRadiusEdge) {
    return absl::InvalidArgumentError("criterion: a domain with segments has the radius-edge criterion alone");
  }
  if (parameters.merge_distance > 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("merge_distance: near points of a domain with segments are not merged, and it is ",
                     parameters.merge_distance, "; leave it out"));
  }
  if (features.faces != FaceRule::kBox && !parameters.domain_low.empty()) {
    return absl::InvalidArgumentError(
        "domain: a box bounds a domain with segments by the face rule `box` alone; leave one of the two out");
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
