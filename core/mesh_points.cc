#include <algorithm>

#include "core/base/status_macros.h"
#include "core/mesher.h"

namespace wellspace::core {
namespace {

// What is reserved for a mesh, over what it is estimated to take.
constexpr double kReserve = 1.25;

}  // namespace

absl::Status ReserveMemory(const Mesher& mesher, const MeshParameters& parameters, RunContext& context) {
  if (!context.HasMemoryLender()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const MeshEstimate estimate, mesher.Estimate(parameters, context));
  context.SetEstimatedVertices(estimate.vertices);
  const uint64_t vertices = std::max<uint64_t>(1, estimate.vertices);
  const double share = std::min(1.0, static_cast<double>(VertexBudget(parameters)) / static_cast<double>(vertices));
  return context.ReserveMemory(static_cast<uint64_t>(static_cast<double>(estimate.memory_bytes) * share * kReserve));
}

absl::StatusOr<Mesh> MeshPoints(const MeshParameters& parameters, std::span<const double> points, RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<Mesher> mesher, Mesher::Create(parameters, points, context));
  WELLSPACE_RETURN_IF_ERROR(ReserveMemory(*mesher, parameters, context));
  WELLSPACE_RETURN_IF_ERROR(mesher->Refine(parameters, context));
  return mesher->Extract(parameters.threads, context);
}

absl::StatusOr<MeshEstimate> EstimateMesh(const MeshParameters& parameters, std::span<const double> points,
                                          RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<Mesher> mesher, Mesher::Create(parameters, points, context));
  return mesher->Estimate(parameters, context);
}

}  // namespace wellspace::core
