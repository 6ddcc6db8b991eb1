#include "core/mesher.h"

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/box_mesher.h"
#include "core/domain_parameters.h"
#include "core/plane_mesher.h"

namespace wellspace::core {
namespace {

template <int D>
absl::StatusOr<std::unique_ptr<Mesher>> CreateIn(const MeshParameters& parameters, std::span<const double> points,
                                                 RunContext& context) {
  auto mesher = std::make_unique<BoxMesher<D>>();
  WELLSPACE_RETURN_IF_ERROR(mesher->Initialize(parameters, points, context));
  return mesher;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Mesher>> Mesher::Create(const MeshParameters& parameters, std::span<const double> points,
                                                       RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  switch (parameters.dimension) {
#define WELLSPACE_CASE(D) \
  case D:                 \
    return CreateIn<D>(parameters, points, context);
    WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_CASE)
#undef WELLSPACE_CASE
    default:
      return absl::InternalError("ValidateParameters lets no other dimension pass");
  }
}

absl::StatusOr<std::unique_ptr<Mesher>> Mesher::CreateInDomain(const MeshParameters& parameters,
                                                               std::span<const double> points, const Features& features,
                                                               RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(ValidateDomainParameters(parameters, features));
  auto mesher = std::make_unique<PlaneMesher>();
  WELLSPACE_RETURN_IF_ERROR(mesher->Initialize(parameters, {points, features}, context));
  return mesher;
}

}  // namespace wellspace::core
