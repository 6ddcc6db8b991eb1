// The common part of calls that take a cloud: they receive it, and queue a job.
#ifndef WELLSPACE_SERVER_SERVICES_MESHING_CLOUD_CALL_H_
#define WELLSPACE_SERVER_SERVICES_MESHING_CLOUD_CALL_H_

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "grpcpp/support/byte_buffer.h"
#include "server/calls/call.h"
#include "server/calls/request_stream.h"
#include "server/calls/wire.h"
#include "server/jobs/job_pool.h"
#include "server/jobs/job_size.h"
#include "server/jobs/memory_budget.h"
#include "server/services/meshing/cloud_receiver.h"
#include "server/wire/errors.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// A Call whose requests go to a CloudReceiver; at their end a job is queued; the use of its result is up to the
// class that derives from this. `Reactor` is gRPC's, for the kind of stream that answers; it reads bytes, which are
// `Request`s.
//
// Thread safety and invariants: those of RequestStream.
template <typename Reactor, typename Request>
class CloudCall : public RequestStream<Call<Reactor>> {
 protected:
  CloudCall(const CallEnvironment& environment, grpc::CallbackServerContext* context)
      : RequestStream<Call<Reactor>>(environment, context), receiver_(environment.options) {}

  // On a worker: works, and hands over the result.
  virtual void Work(NumberChunks& points, Job& job) = 0;

  // The following are called with mutex_ held, and want it to be held when they are called.

  // Whether Work with `points` takes about a second at most.
  virtual bool IsSmall(const NumberChunks& points) const = 0;
  // The parameters have come, with `request`.
  virtual void OnParameters(const Request& /*request*/) {}
  // Of the mesh, for the log; 0 when there is none.
  virtual uint64_t VertexCount() const = 0;

  void OnBegin() final;
  void OnRequest(grpc::ByteBuffer* bytes) final;
  void OnRequestsEnd() final { SubmitJob(); }
  void OnEnd() override;
  LogFields Figures() const final {
    return LogFields().Add("points", receiver_.point_count()).Add("vertices", VertexCount());
  }
  // Null before it is queued.
  const std::shared_ptr<Job>& job() const { return job_; }
  // Constant once there is a job, but for many sizes at points, which Work finds there.
  const core::MeshParameters& parameters() const { return receiver_.parameters(); }
  const FeatureStore& features() const { return receiver_.features(); }

 private:
  void SubmitJob();
  // Sets memory aside for the points so far, and for the next message, and reads that; or ends with MEMORY_LIMIT.
  void ReadNextWithMemory();

  // Guarded by mutex_.
  CloudReceiver receiver_;
  MemoryReservation received_;
  std::shared_ptr<Job> job_;
};

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::OnBegin() {
  received_ = this->environment().memory.ReserveNothing();
  ReadNextWithMemory();
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::ReadNextWithMemory() {
  const uint64_t bytes = receiver_.held_bytes() + kMessageBytes;
  const auto reserve = [this, bytes] {
    return received_.Resize(bytes) ? absl::OkStatus()
                                   : this->environment().memory.Refusal(bytes, "the next part of the cloud");
  };
  this->ReserveThen(bytes - std::min(bytes, received_.bytes()), reserve, [this] { this->ReadNext(); });
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::OnRequest(grpc::ByteBuffer* bytes) {
  const bool had_parameters = receiver_.has_parameters();
  Request request;
  absl::Status status = ParseRequest(bytes, &request);
  if (status.ok()) {
    status = receiver_.Accept(&request);
  }
  if (!status.ok()) {
    this->End(std::move(status));
    return;
  }
  if (!had_parameters) {
    OnParameters(request);
  }
  ReadNextWithMemory();
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::SubmitJob() {
  if (absl::Status status = receiver_.AcceptEnd(); !status.ok()) {
    this->End(std::move(status));
    return;
  }
  (void)received_.Resize(receiver_.held_bytes());                         // no more than it was
  const bool has_many_sizes = receiver_.size_count() > kMostSmallPoints;  // too many to be copied here
  if (!has_many_sizes) {
    receiver_.FlattenSizes(core::RunContext());
  }
  // std::function wants to be copied, points do not.
  auto points = std::make_shared<NumberChunks>(receiver_.TakePoints());
  absl::StatusOr<std::shared_ptr<Job>> job = this->environment().jobs.Submit(
      {.tenant = this->caller().tenant,
       .is_small = !has_many_sizes && IsSmall(*points),
       .held = std::move(received_),
       .work = [self = this->template SharedAs<CloudCall>(), points, has_many_sizes](Job& running) {
         if (has_many_sizes) {
           self->receiver_.FlattenSizes(running.context());
         }
         self->Work(*points, running);
       }});
  if (!job.ok()) {
    this->End(std::move(job).status());
    return;
  }
  job_ = *std::move(job);
}

template <typename Reactor, typename Request>
void CloudCall<Reactor, Request>::OnEnd() {
  this->environment().observability.work().OnPoints(receiver_.point_count());
  receiver_.TakePoints();
  received_.Release();
  if (job_ != nullptr) {
    this->environment().jobs.Cancel(job_);
  }
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_MESHING_CLOUD_CALL_H_
