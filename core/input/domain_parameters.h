// The parameters that a domain in the plane can have.
#ifndef WELLSPACE_CORE_INPUT_DOMAIN_PARAMETERS_H_
#define WELLSPACE_CORE_INPUT_DOMAIN_PARAMETERS_H_

#include "absl/status/status.h"
#include "core/features/features.h"
#include "core/input/mesh_parameters.h"

namespace wellspace::core {

// Refuses parameters that a domain with `features` does not have, whatever its points: those that ValidateParameters
// refuses, another dimension than 2 or criterion than kRadiusEdge, a snap distance that is none or that no rule asks
// for, a box beside another rule than FaceRule::kBox. Ends, markers and seeds are not looked at.
//
// Complexity: that of ValidateParameters.
// Errors:     INVALID_ARGUMENT; the message begins with the name of the parameter and a colon.
absl::Status ValidateDomainParameters(const MeshParameters& parameters, const Features& features);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_DOMAIN_PARAMETERS_H_
