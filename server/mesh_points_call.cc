#include "server/mesh_points_call.h"

#include <optional>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "server/convert.h"
#include "server/errors.h"

namespace wellspace::server {
namespace {

// A client whose deadline passes cancels its call a moment before the same deadline, counted from the arrival of the request, passes
// here. Only the log tells the two apart.
constexpr absl::Duration kDeadlineSlack = absl::Milliseconds(100);

}  // namespace

MeshPointsCall* MeshPointsCall::Start(const CallEnvironment& environment, grpc::CallbackServerContext* context) {
  std::shared_ptr<MeshPointsCall> call(new MeshPointsCall(environment, context));
  std::lock_guard lock(call->mutex_);
  call->self_ = call;
  const CallRegistry::Admission admission = environment.calls.Add([weak = call->weak_from_this()] {
    if (const std::shared_ptr<MeshPointsCall> locked = weak.lock()) {
      locked->Abort();
    }
  });
  call->id_ = admission.id;
  if (admission.admitted) {
    call->StartRead(&call->request_);
  } else {
    call->End(MakeError(v1::ERROR_REASON_SERVER_STOPPING, "the server is stopping and takes no new calls"));
  }
  return call.get();
}

MeshPointsCall::MeshPointsCall(const CallEnvironment& environment, grpc::CallbackServerContext* context)
    : environment_(environment),
      context_(context),
      peer_(context->peer()),
      start_(absl::Now()),
      receiver_(environment.options) {}

void MeshPointsCall::Abort() {
  std::lock_guard lock(mutex_);
  End(MakeError(v1::ERROR_REASON_SERVER_STOPPING, "the server stopped before the mesh was delivered"));
}

void MeshPointsCall::OnReadDone(bool ok) {
  std::lock_guard lock(mutex_);
  if (ending_) {
    return;
  }
  if (!ok) {
    // Either the client has sent all, or it is gone; in the latter case OnCancel ends the call, at the latest right after this.
    if (!context_->IsCancelled()) {
      SubmitJob();
    }
    return;
  }
  const bool had_parameters = receiver_.has_parameters();
  if (grpc::Status status = receiver_.Accept(&request_); !status.ok()) {
    End(std::move(status));
    return;
  }
  if (!had_parameters) {
    ScheduleTick();
  }
  StartRead(&request_);
}

void MeshPointsCall::SubmitJob() {
  if (grpc::Status status = receiver_.AcceptEnd(); !status.ok()) {
    End(std::move(status));
    return;
  }
  // std::function wants to be copied, points do not.
  auto points = std::make_shared<PointChunks>(receiver_.TakePoints());
  job_ = environment_.jobs.Submit([self = shared_from_this(), points](core::RunContext& context) {
    self->OnJobDone(self->Work(*points, context));
  });
  if (job_ == nullptr) {
    End(MakeError(v1::ERROR_REASON_QUEUE_FULL, "too many jobs are waiting on this server; try again later"));
  }
}

MeshPointsCall::Outcome MeshPointsCall::Work(PointChunks& points, core::RunContext& context) const {
  Outcome outcome;
  outcome.status = RunGuarded([&] {
    const std::vector<double> coordinates = points.Flatten();
    absl::StatusOr<core::Mesh> mesh = environment_.mesher(receiver_.parameters(), coordinates, context);
    if (!mesh.ok()) {
      return FromCoreStatus(mesh.status());
    }
    outcome.mesh = std::make_shared<MeshChunks>(*std::move(mesh));
    return grpc::Status::OK;
  });
  return outcome;
}

void MeshPointsCall::OnJobDone(Outcome outcome) {
  std::lock_guard lock(mutex_);
  if (ending_) {
    return;
  }
  if (!outcome.status.ok()) {
    if (outcome.status.error_code() == grpc::StatusCode::INTERNAL) {
      environment_.log.error("call={} {}", id_, outcome.status.error_message());
    }
    End(std::move(outcome.status));
    return;
  }
  mesh_ = std::move(outcome.mesh);
  core::Progress progress = job_->context().Snapshot();
  progress.vertices = mesh_->mesh().vertex_count();
  progress.simplices = mesh_->mesh().simplex_count();
  ready_.clear();  // an event that has not left yet is outdated
  *ready_.emplace_back().mutable_progress() = pacer_.Final(progress);
  *ready_.emplace_back().mutable_metadata() = MetadataToProto(mesh_->mesh(), mesh_->count());
  MakeAhead();
  WriteNext();
}

void MeshPointsCall::ScheduleTick() {
  environment_.background.PostAfter(ProgressPacer::kMinInterval, [weak = weak_from_this()] {
    if (const std::shared_ptr<MeshPointsCall> call = weak.lock()) {
      call->Tick();
    }
  });
}

void MeshPointsCall::Tick() {
  std::lock_guard lock(mutex_);
  if (ending_ || mesh_ != nullptr) {
    return;
  }
  // While a reader is slow, events are skipped, not stored.
  if (!writing_) {
    const core::Progress progress = job_ == nullptr ? core::Progress() : job_->context().Snapshot();
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
    environment_.background.Post([self = shared_from_this()] { self->MakeChunk(); });
  }
}

void MeshPointsCall::MakeChunk() {
  std::unique_lock lock(mutex_);
  if (ending_) {
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
  if (ending_) {
    return;
  }
  if (!status.ok()) {
    End(std::move(status));
    return;
  }
  environment_.log.debug("call={} chunk={} made", id_, index);
  ready_.push_back(std::move(response));
  MakeAhead();
  WriteNext();
}

void MeshPointsCall::WriteNext() {
  if (writing_ || ending_) {
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
  if (ending_) {
    Finish(final_status_);
    return;
  }
  if (!ok) {
    End(grpc::Status(grpc::StatusCode::CANCELLED, "the client is gone"));
    return;
  }
  WriteNext();
  if (mesh_ != nullptr && !ending_) {
    MakeAhead();
  }
}

void MeshPointsCall::OnCancel() {
  std::lock_guard lock(mutex_);
  const bool late = absl::FromChrono(context_->deadline()) <= absl::Now() + kDeadlineSlack;
  End(late ? grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "the deadline of the call passed")
           : grpc::Status(grpc::StatusCode::CANCELLED, "the client cancelled the call or is gone"));
}

void MeshPointsCall::End(grpc::Status status) {
  if (ending_) {
    return;
  }
  ending_ = true;
  final_status_ = std::move(status);
  ready_.clear();
  receiver_.TakePoints();
  if (job_ != nullptr) {
    environment_.jobs.Cancel(job_);
  }
  if (!writing_) {
    Finish(final_status_);
  }
}

void MeshPointsCall::OnDone() {
  std::shared_ptr<MeshPointsCall> self;
  {
    std::lock_guard lock(mutex_);
    const auto code = static_cast<absl::StatusCode>(final_status_.error_code());
    environment_.log.info("call={} method=MeshPoints peer={} code={} seconds={:.3f} points={} vertices={}{}{}", id_,
                          peer_, absl::StatusCodeToString(code), absl::ToDoubleSeconds(absl::Now() - start_),
                          receiver_.point_count(), mesh_ == nullptr ? 0 : mesh_->mesh().vertex_count(),
                          final_status_.ok() ? "" : " message=", final_status_.error_message());
    self = std::move(self_);
  }
  environment_.calls.Remove(id_);
  // The last one to hold the call deletes it.
}

}  // namespace wellspace::server
