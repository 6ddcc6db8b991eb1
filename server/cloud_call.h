// What the calls that take a cloud have in common, whatever they do with it.
#ifndef WELLSPACE_SERVER_CLOUD_CALL_H_
#define WELLSPACE_SERVER_CLOUD_CALL_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/mesher.h"
#include "grpcpp/server_context.h"
#include "server/authenticator.h"
#include "server/background.h"
#include "server/call_registry.h"
#include "server/cloud_receiver.h"
#include "server/errors.h"
#include "server/jobs.h"
#include "server/memory_budget.h"
#include "server/options.h"
#include "spdlog/logger.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// What meshes: core::MeshPoints, or what a test puts in its place.
using Mesher =
    std::function<absl::StatusOr<core::Mesh>(const core::MeshParameters&, std::span<const double>, core::RunContext&)>;
// What estimates: core::EstimateMesh, or what a test puts in its place.
using Estimator = std::function<absl::StatusOr<core::MeshEstimate>(const core::MeshParameters&, std::span<const double>,
                                                                   core::RunContext&)>;

// What all calls of a service share; outlives them.
struct CallEnvironment {
  const ServiceOptions& options;
  const Mesher& mesher;
  const Estimator& estimator;
  const Authenticator& authenticator;
  MemoryBudget& memory;
  JobPool& jobs;
  Background& background;
  CallRegistry& calls;
  spdlog::logger& log;
};

// The reactor of one call. Its requests go to a CloudReceiver; at their end a job is queued; what becomes of its result is up to the
// class that derives from this. `Reactor` is gRPC's, for the kind of stream that answers, and `Request` what it reads.
//
// Lifetime: held by itself until OnDone, and by whatever else may still call it: its job and tasks of the background thread.
// Thread safety: thread-safe: reactions, the worker, the background thread and Abort may come at the same time.
// Invariants: (1) Finish is called once, not while IsWriting(); (2) once ending() is true, no read, write, job or task is started any
// more; (3) the lock order is this call's mutex, then those of what it uses.
template <typename Reactor, typename Request>
class CloudCall : public Reactor, public std::enable_shared_from_this<CloudCall<Reactor, Request>> {
 public:
  // Ends the call with UNAVAILABLE, since the server stops.
  void Abort();

  void OnReadDone(bool ok) final;
  void OnCancel() final;
  void OnDone() final;

 protected:
  // `method` is its name in the log.
  CloudCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, const char* method)
      : environment_(environment),
        context_(context),
        method_(method),
        peer_(context->peer()),
        start_(absl::Now()),
        receiver_(environment.options) {}

  // Begins to serve `call`, which deletes itself. To be called once.
  static void Begin(const std::shared_ptr<CloudCall>& call);

  // On a worker: works, and hands over what came of it.
  virtual void Work(PointChunks& points, Job& job) = 0;

  // The following are called with mutex_ held, and want it to be held when they are called.

  // The parameters have come.
  virtual void OnParameters() {}
  // A write is in flight: Finish has to wait for it. When it is done and ending() is true, FinishNow is to be called.
  virtual bool IsWriting() const { return false; }
  // The call ends: what it still holds can go.
  virtual void DropAnswer() {}
  // Of the mesh, for the log; 0 when there is none.
  virtual uint64_t VertexCount() const = 0;

  // Ends the call with `status`: now, or when the write in flight is done. Only the first call counts.
  void End(grpc::Status status);
  // Ends the call with the error of its work, which the log should know.
  void EndFailed(grpc::Status status);
  void FinishNow() { this->Finish(final_status_); }
  bool ending() const { return ending_; }
  // Null before it is queued.
  const std::shared_ptr<Job>& job() const { return job_; }

  const CallEnvironment& environment() const { return environment_; }
  uint64_t id() const { return id_; }
  // Constant from Begin on.
  const Caller& caller() const { return caller_; }
  // Constant once there is a job.
  const core::MeshParameters& parameters() const { return receiver_.parameters(); }

  std::mutex mutex_;

 private:
  // A client whose deadline passes cancels its call a moment before the same deadline, counted from the arrival of the request, passes
  // here. Only the log tells the two apart.
  static constexpr absl::Duration kDeadlineSlack = absl::Milliseconds(100);

  void SubmitJob();

  const CallEnvironment& environment_;
  grpc::CallbackServerContext* const context_;  // valid until OnDone
  const char* const method_;
  const std::string peer_;
  const absl::Time start_;
  uint64_t id_ = 0;
  Caller caller_;

  // Guarded by mutex_.
  std::shared_ptr<CloudCall> self_;
  CloudReceiver receiver_;
  Request request_;  // of the read in flight
  bool ending_ = false;
  grpc::Status final_status_;
  std::shared_ptr<Job> job_;
};

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::Begin(const std::shared_ptr<CloudCall>& call) {
  std::lock_guard lock(call->mutex_);
  call->self_ = call;
  const CallRegistry::Admission admission = call->environment_.calls.Add([weak = call->weak_from_this()] {
    if (const std::shared_ptr<CloudCall> locked = weak.lock()) {
      locked->Abort();
    }
  });
  call->id_ = admission.id;
  if (grpc::Status status = call->environment_.authenticator.Authenticate(*call->context_, &call->caller_);
      !status.ok()) {
    call->End(std::move(status));
  } else if (!admission.admitted) {
    call->End(MakeError(v1::ERROR_REASON_SERVER_STOPPING, "the server is stopping and takes no new calls"));
  } else {
    call->StartRead(&call->request_);
  }
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::Abort() {
  std::lock_guard lock(mutex_);
  End(MakeError(v1::ERROR_REASON_SERVER_STOPPING, "the server stopped before the answer was delivered"));
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::OnReadDone(bool ok) {
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
    OnParameters();
  }
  this->StartRead(&request_);
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::SubmitJob() {
  if (grpc::Status status = receiver_.AcceptEnd(); !status.ok()) {
    End(std::move(status));
    return;
  }
  // std::function wants to be copied, points do not.
  auto points = std::make_shared<PointChunks>(receiver_.TakePoints());
  JobPool::Submission submission =
      environment_.jobs.Submit({.tenant = caller_.tenant, .work = [self = this->shared_from_this(), points](Job& job) {
                                  self->Work(*points, job);
                                }});
  job_ = std::move(submission.job);
  if (job_ == nullptr) {
    End(std::move(submission.refusal));
  }
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::OnCancel() {
  std::lock_guard lock(mutex_);
  const bool late = absl::FromChrono(context_->deadline()) <= absl::Now() + kDeadlineSlack;
  End(late ? grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "the deadline of the call passed")
           : grpc::Status(grpc::StatusCode::CANCELLED, "the client cancelled the call or is gone"));
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::EndFailed(grpc::Status status) {
  if (status.error_code() == grpc::StatusCode::INTERNAL) {
    environment_.log.error("call={} {}", id_, status.error_message());
  }
  End(std::move(status));
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::End(grpc::Status status) {
  if (ending_) {
    return;
  }
  ending_ = true;
  final_status_ = std::move(status);
  DropAnswer();
  receiver_.TakePoints();
  if (job_ != nullptr) {
    environment_.jobs.Cancel(job_);
  }
  if (!IsWriting()) {
    FinishNow();
  }
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::OnDone() {
  std::shared_ptr<CloudCall> self;
  {
    std::lock_guard lock(mutex_);
    const auto code = static_cast<absl::StatusCode>(final_status_.error_code());
    environment_.log.info("call={} method={} tenant={} peer={} code={} seconds={:.3f} points={} vertices={}{}{}", id_,
                          method_, caller_.tenant, peer_, absl::StatusCodeToString(code),
                          absl::ToDoubleSeconds(absl::Now() - start_), receiver_.point_count(), VertexCount(),
                          final_status_.ok() ? "" : " message=", final_status_.error_message());
    self = std::move(self_);
  }
  environment_.calls.Remove(id_);
  // The last one to hold the call deletes it.
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CLOUD_CALL_H_
