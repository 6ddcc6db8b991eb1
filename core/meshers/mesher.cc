#include "core/meshers/mesher.h"

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/input/domain_parameters.h"
#include "core/input/space_parameters.h"
#include "core/meshers/box_mesher.h"
#include "core/meshers/plane_mesher.h"
#include "core/meshers/space_mesher.h"

namespace wellspace::core {
namespace {

template <typename MesherOfDomain>
absl::StatusOr<std::unique_ptr<Mesher>> CreateAs(const MeshParameters& parameters, const Input& input,
                                                 RunContext& context) {
  auto mesher = std::make_unique<MesherOfDomain>();
  WELLSPACE_RETURN_IF_ERROR(mesher->Initialize(parameters, input, context));
  return mesher;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Mesher>> Mesher::Create(const MeshParameters& parameters, const Input& input,
                                                       RunContext& context) {
  if (input.features.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(ValidateDomainParameters(parameters, *input.features));
    return CreateAs<PlaneMesher>(parameters, input, context);
  }
  if (input.surface.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(ValidateSpaceParameters(parameters, *input.surface));
    return CreateAs<SpaceMesher>(parameters, input, context);
  }
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  switch (parameters.dimension) {
#define WELLSPACE_CASE(D) \
  case D:                 \
    return CreateAs<BoxMesher<D>>(parameters, input, context);
    WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_CASE)
#undef WELLSPACE_CASE
    default:
      return absl::InternalError("ValidateParameters lets no other dimension pass");
  }
}

}  // namespace wellspace::core
