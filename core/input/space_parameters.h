// The parameters that a domain in space can have, and their defaults.
#ifndef WELLSPACE_CORE_INPUT_SPACE_PARAMETERS_H_
#define WELLSPACE_CORE_INPUT_SPACE_PARAMETERS_H_

#include "absl/status/status.h"
#include "core/features/surface_features.h"
#include "core/input/mesh_parameters.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

// Refuses parameters that no domain in space can have, those that ValidateParameters refuses included.
//
// Errors:     INVALID_ARGUMENT, naming the field, its value and what would be accepted.
absl::Status ValidateSpaceParameters(const MeshParameters& parameters, const SurfaceFeatures& features);

// The tolerance of a surface with that diagonal, where none is given: of a wrap it is its resolution.
double DefaultToleranceOf(const SurfaceFeatures& features, double diagonal);

// The criteria of facets and curves of `parameters`, on the scale of the computation; `default_tolerance`: not scaled.
//
// REQUIRES:   the parameters are valid.
SurfaceCriteria SurfaceCriteriaOf(const MeshParameters& parameters, double default_tolerance, double scale);

// The length that edges on curves are to have at most; infinite where there is no bound. Not scaled.
double CurveEdgeOf(const MeshParameters& parameters);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SPACE_PARAMETERS_H_
