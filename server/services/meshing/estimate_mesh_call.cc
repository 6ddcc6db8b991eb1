#include "server/services/meshing/estimate_mesh_call.h"

#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/jobs/job_size.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void EstimateMeshCall::Work(NumberChunks& points, Job& job) {
  core::MeshEstimate estimate{};
  absl::Status status = RunGuarded([&] {
    const std::vector<double> coordinates = points.Flatten(job.context());
    WELLSPACE_ASSIGN_OR_RETURN(estimate,
                               environment().estimator(parameters(), features().InputOf(coordinates), job.context()));
    return absl::OkStatus();
  });
  std::lock_guard lock(mutex_);
  if (ending()) {
    return;
  }
  if (!status.ok()) {
    End(std::move(status));
    return;
  }
  vertices_ = estimate.vertices;
  *response_ = Serialize(EstimateToProto(estimate));
  End(absl::OkStatus());
}

bool EstimateMeshCall::IsSmall(const NumberChunks& points) const {
  const int dimension = parameters().dimension;
  return IsSmallEstimate(dimension, points.count() / dimension + features().counts().triangles);
}

}  // namespace wellspace::server
