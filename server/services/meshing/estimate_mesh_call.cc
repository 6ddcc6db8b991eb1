#include "server/services/meshing/estimate_mesh_call.h"

#include <utility>
#include <vector>

#include "server/calls/wire.h"
#include "server/jobs/job_size.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void EstimateMeshCall::Work(PointChunks& points, Job& job) {
  core::MeshEstimate estimate{};
  grpc::Status status = RunGuarded([&] {
    const std::vector<double> coordinates = points.Flatten(job.context());
    const absl::StatusOr<core::MeshEstimate> made =
        features().IsEmpty() ? environment().estimator(parameters(), coordinates, job.context())
                             : core::EstimateFeatures(parameters(), coordinates, features().View(), job.context());
    if (made.ok()) {
      estimate = *made;
    }
    return FromCoreStatus(made.status());
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
  End(grpc::Status::OK);
}

bool EstimateMeshCall::IsSmall(const PointChunks& points) const {
  const int dimension = parameters().dimension;
  return IsSmallEstimate(dimension, points.coordinate_count() / dimension);
}

}  // namespace wellspace::server
