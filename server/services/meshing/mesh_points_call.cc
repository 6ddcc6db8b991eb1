#include "server/services/meshing/mesh_points_call.h"

#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/base/clock.h"
#include "server/calls/wire.h"
#include "server/jobs/job_size.h"
#include "server/store/usage_meter.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void MeshPointsCall::Work(NumberChunks& points, Job& job) {
  std::shared_ptr<MeshChunks> mesh;
  absl::Status status = RunGuarded([&] {
    const std::vector<double> coordinates = points.Flatten(job.context());
    WELLSPACE_ASSIGN_OR_RETURN(core::Mesh made,
                               environment().mesher(parameters(), features().InputOf(coordinates), job.context()));
    mesh = std::make_shared<MeshChunks>(std::move(made));
    mesh->KeepMemory(job.TakeMemory(mesh->memory_bytes()));
    environment().observability.work().OnMesh(mesh->mesh().vertex_count(), mesh->mesh().simplex_count());
    environment().usage.AddMesh(job.tenant(), mesh->mesh().vertex_count());
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
  mesh_ = std::move(mesh);
  core::Progress progress = job.context().Snapshot();
  progress.vertices = mesh_->mesh().vertex_count();
  progress.simplices = mesh_->mesh().simplex_count();
  event_ = pacer_.Final(progress);
  WriteNext();
}

bool MeshPointsCall::IsSmall(const NumberChunks& points) const {
  const FeatureCounts counts = features().counts();
  return points.count() <= kMostSmallPoints * parameters().dimension && counts.segments <= kMostSmallPoints &&
         counts.triangles == 0 && IsSmallMesh(parameters(), points.Copy());
}

void MeshPointsCall::ScheduleTick() {
  environment().background.PostAfter(ProgressPacer::kMinInterval, WeakCall(&MeshPointsCall::Tick));
}

void MeshPointsCall::Tick() {
  std::lock_guard lock(mutex_);
  if (ending() || mesh_ != nullptr) {
    return;
  }
  // While a reader is slow, events are skipped, not stored.
  if (!IsWriting()) {
    const core::Progress progress = job() == nullptr ? core::Progress() : job()->context().Snapshot();
    event_ = pacer_.Next(progress, SinceBoot());
    WriteNext();
  }
  ScheduleTick();
}

std::optional<grpc::ByteBuffer> MeshPointsCall::NextResponse() {
  v1::MeshPointsResponse response;
  if (event_.has_value()) {
    *response.mutable_progress() = *std::exchange(event_, std::nullopt);
  } else if (mesh_ == nullptr) {
    return std::nullopt;
  } else if (!metadata_sent_) {
    metadata_sent_ = true;
    *response.mutable_metadata() = MetadataToProto(mesh_->mesh(), mesh_->count(with_boundary_), with_boundary_);
  } else if (next_chunk_ < mesh_->count(with_boundary_)) {
    environment().log.debug("call={} chunk={}", id(), next_chunk_);
    return SerializeChunk(mesh_, next_chunk_++, v1::MeshPointsResponse::kChunkFieldNumber, with_boundary_);
  } else {
    End(absl::OkStatus());
    return std::nullopt;
  }
  return Serialize(response);
}

}  // namespace wellspace::server
