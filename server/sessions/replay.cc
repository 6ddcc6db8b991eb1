#include "server/sessions/replay.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"

namespace wellspace::server {
namespace {

// A vertex that is added takes as much memory as this many of those that there are, at most in all but the most uneven
// clouds.
constexpr uint64_t kVerticesForOne = 2;

// The structure as far as the steps have made it.
class Structure {
 public:
  Structure(const SessionInputs& inputs, const MesherFactory& create_mesher)
      : inputs_(inputs), create_mesher_(create_mesher) {}

  absl::Status Take(const SessionStep& step, core::RunContext& context) {
    if (mesher_ == nullptr) {
      return Begin(step, context);
    }
    WELLSPACE_RETURN_IF_ERROR(AddPointsUntil(step.uploads_end, context));
    if (step.refined_with == nullptr) {
      return AddPointsUntil(step.end, context);
    }
    const core::MeshParameters parameters = inputs_.ParametersOf(step);
    WELLSPACE_RETURN_IF_ERROR(mesher_->Refine(parameters, context));
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(mesher_->memory_bytes() + mesh_.points.size() * sizeof(double) +
                                                  mesh_.simplices.size() * sizeof(uint32_t)));
    return mesher_->Update(mesh_, parameters.threads, context);
  }

  const core::Mesh& mesh() const { return mesh_; }
  std::unique_ptr<core::Mesher> TakeMesher() { return std::move(mesher_); }

 private:
  absl::Status Begin(const SessionStep& step, core::RunContext& context) {
    const core::MeshParameters parameters = inputs_.ParametersOf(step);
    {
      taken_ = step.end;
      WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> points,
                                 inputs_.points->Copy(0, step.end * parameters.dimension, context));
      WELLSPACE_ASSIGN_OR_RETURN(mesher_, BeginMesh(create_mesher_, parameters, points, *inputs_.features, context));
    }
    WELLSPACE_RETURN_IF_ERROR(core::ReserveMemory(*mesher_, parameters, context));
    WELLSPACE_RETURN_IF_ERROR(mesher_->Refine(parameters, context));
    WELLSPACE_ASSIGN_OR_RETURN(mesh_, mesher_->Extract(parameters.threads, context));
    return absl::OkStatus();
  }

  absl::Status AddPointsUntil(uint64_t end, core::RunContext& context) {
    const uint64_t first = std::exchange(taken_, end);
    return first == end ? absl::OkStatus() : AddPointsTo(*mesher_, *inputs_.points, first, end, context);
  }

  const SessionInputs& inputs_;
  const MesherFactory& create_mesher_;
  std::unique_ptr<core::Mesher> mesher_;
  core::Mesh mesh_;
  uint64_t taken_ = 0;  // of the points
};

}  // namespace

absl::StatusOr<std::unique_ptr<core::Mesher>> BeginMesh(const MesherFactory& create_mesher,
                                                        const core::MeshParameters& parameters,
                                                        std::span<const double> points, const FeatureStore& features,
                                                        core::RunContext& context) {
  return create_mesher(parameters, features.InputOf(points), context);
}

uint64_t BytesWithVertices(const core::Mesher& mesher, uint64_t count) {
  const uint64_t bytes = mesher.memory_bytes();
  return bytes + kVerticesForOne * count * (bytes / std::max<uint64_t>(1, mesher.vertex_count()));
}

absl::Status AddPointsTo(core::Mesher& mesher, const PointStore& points, uint64_t first, uint64_t end,
                         core::RunContext& context) {
  const uint64_t dimension = mesher.dimension();
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(BytesWithVertices(mesher, end - first)));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> added, points.Copy(first * dimension, end * dimension, context));
  return mesher.AddPoints(added, context).status();
}

absl::StatusOr<std::unique_ptr<core::Mesher>> Replay(const SessionInputs& inputs, const MeshSnapshot& last_mesh,
                                                     const MesherFactory& create_mesher, Job& job) {
  Structure structure(inputs, create_mesher);
  for (const SessionStep& step : inputs.state->steps.all()) {
    WELLSPACE_RETURN_IF_ERROR(job.RunApart([&](core::RunContext& context) { return structure.Take(step, context); }));
  }
  WELLSPACE_RETURN_IF_ERROR(last_mesh.CheckSame(structure.mesh()));
  return structure.TakeMesher();
}

}  // namespace wellspace::server
