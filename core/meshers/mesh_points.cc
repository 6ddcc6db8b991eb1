#include <algorithm>

#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/meshers/mesher.h"

namespace wellspace::core {
namespace {

// The memory that is reserved for a mesh, relative to its estimate.
constexpr double kReserve = 1.25;

}  // namespace

absl::Status ReserveMemory(const Mesher& mesher, const MeshParameters& parameters, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(mesher.CheckFeasible(parameters));
  if (!context.HasMemoryLender()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const MeshEstimate estimate, mesher.EstimateToReserve(parameters, context));
  context.SetEstimatedVertices(estimate.vertices);
  const uint64_t most = VertexBudget(parameters);
  const auto all = static_cast<double>(estimate.memory_bytes);
  const double bytes =
      estimate.vertices > most ? std::min(all, static_cast<double>(most) * estimate.bytes_per_vertex) : all;
  return context.ReserveMemory(SaturatedCount(bytes * kReserve));
}

absl::StatusOr<Mesh> MeshPoints(const MeshParameters& parameters, const Input& input, RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<Mesher> mesher, Mesher::Create(parameters, input, context));
  WELLSPACE_RETURN_IF_ERROR(ReserveMemory(*mesher, parameters, context));
  WELLSPACE_RETURN_IF_ERROR(mesher->Refine(parameters, context));
  return mesher->Extract(parameters.threads, context);
}

absl::StatusOr<MeshEstimate> EstimateMesh(const MeshParameters& parameters, const Input& input, RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<Mesher> mesher, Mesher::Create(parameters, input, context));
  return mesher->Estimate(parameters, context);
}

}  // namespace wellspace::core
