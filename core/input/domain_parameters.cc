#include "core/input/domain_parameters.h"

#include <cmath>

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
  if (!(features.snap_distance >= 0 && std::isfinite(features.snap_distance))) {
    return absl::InvalidArgumentError(
        absl::StrCat("snap_distance: ", features.snap_distance, " is not a finite number of at least 0"));
  }
  if (features.snap_distance > 0 && features.crossings == CrossingRule::kRefuse) {
    return absl::InvalidArgumentError(
        absl::StrCat("snap_distance: segments are not led through points by the rule `refuse`, and it is ",
                     features.snap_distance, "; take `snap` or `split`, or leave it out"));
  }
  if (features.faces != FaceRule::kBox && !parameters.domain_low.empty()) {
    return absl::InvalidArgumentError(
        "domain: a box bounds a domain with segments by the face rule `box` alone; leave one of the two out");
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
