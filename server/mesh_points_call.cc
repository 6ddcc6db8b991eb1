#include "server/mesh_points_call.h"

#include <optional>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "server/convert.h"
#include "server/errors.h"

namespace wellspace::server {

MeshPointsCall* MeshPointsCall::Start(const CallEnvironment& environment, grpc::CallbackServerContext* context) {
  std::shared_ptr<MeshPointsCall> call(new MeshPointsCall(environment, context));
  Begin(call);
  return call.get();
}

void MeshPointsCall::Work(PointChunks& points, Job& job) {
  std::shared_ptr<const MeshChunks> mesh;
  grpc::Status status = RunGuarded([&] {
    const std::vector<double> coordinates = points.Flatten();
    absl::StatusOr<core::Mesh> made = environment().mesher(parameters(), coordinates, job.context());
    if (!made.ok()) {
      return FromCoreStatus(made.status());
    }
    mesh = std::make_shared<MeshChunks>(*std::move(made));
    return grpc::Status::OK;
  });
  std::lock_guard lock(mutex_);
  if (ending()) {
    return;
  }
  if (!status.ok()) {
    EndFailed(std::move(status));
    return;
  }
  mesh_ = std::move(mesh);
  core::Progress progress = job.context().Snapshot();
  progress.vertices = mesh_->mesh().vertex_count();
  progress.simplices = mesh_->mesh().simplex_count();
  ready_.clear();  // an event that has not left yet is outdated
  *ready_.emplace_back().mutable_progress() = pacer_.Final(progress);
  *ready_.emplace_back().mutable_metadata() = MetadataToProto(mesh_->mesh(), mesh_->count());
  MakeAhead();
  WriteNext();
}

void MeshPointsCall::ScheduleTick() {
  environment().background.PostAfter(ProgressPacer::kMinInterval, [weak = weak_from_this()] {
    if (const auto call = std::static_pointer_cast<MeshPointsCall>(weak.lock())) {
      call->Tick();
    }
  });
}

void MeshPointsCall::Tick() {
  std::lock_guard lock(mutex_);
  if (ending() || mesh_ != nullptr) {
    return;
  }
  // While a reader is slow, events are skipped, not stored.
  if (!writing_) {
    const core::Progress progress = job() == nullptr ? core::Progress() : job()->context().Snapshot();
    if (std::optional<v1::ProgressEvent> event = pacer_.Next(progress, absl::Now())) {
      *ready_.emplace_back().mutable_progress() = *std::move(event);
      WriteNext();
    }
  }
  ScheduleTick();
}

void MeshPointsCall::MakeAhead() {
  if (!making_chunk_ && next_chunk_ < mesh_->count() && ready_.size() < kChunksAhead) {
    making_chunk_ = true;
    environment().background.Post([self = Self()] { self->MakeChunk(); });
  }
}

void MeshPointsCall::MakeChunk() {
  std::unique_lock lock(mutex_);
  if (ending()) {
    return;
  }
  const std::shared_ptr<const MeshChunks> mesh = mesh_;
  const uint64_t index = next_chunk_++;
  lock.unlock();
  v1::MeshPointsResponse response;
  grpc::Status status = RunGuarded([&] {
    *response.mutable_chunk() = mesh->Make(index);
    return grpc::Status::OK;
  });
  lock.lock();
  making_chunk_ = false;
  if (ending()) {
    return;
  }
  if (!status.ok()) {
    End(std::move(status));
    return;
  }
  environment().log.debug("call={} chunk={} made", id(), index);
  ready_.push_back(std::move(response));
  MakeAhead();
  WriteNext();
}

void MeshPointsCall::WriteNext() {
  if (writing_ || ending()) {
    return;
  }
  if (!ready_.empty()) {
    response_ = std::move(ready_.front());
    ready_.pop_front();
    writing_ = true;
    StartWrite(&response_);
  } else if (mesh_ != nullptr && next_chunk_ == mesh_->count() && !making_chunk_) {
    End(grpc::Status::OK);
  }
}

void MeshPointsCall::OnWriteDone(bool ok) {
  std::lock_guard lock(mutex_);
  writing_ = false;
  if (ending()) {
    FinishNow();
    return;
  }
  if (!ok) {
    End(grpc::Status(grpc::StatusCode::CANCELLED, "the client is gone"));
    return;
  }
  WriteNext();
  if (mesh_ != nullptr && !ending()) {
    MakeAhead();
  }
}

}  // namespace wellspace::server
