// One call of MeshPoints.
#ifndef WELLSPACE_SERVER_MESH_POINTS_CALL_H_
#define WELLSPACE_SERVER_MESH_POINTS_CALL_H_

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/mesher.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/background.h"
#include "server/call_registry.h"
#include "server/cloud_receiver.h"
#include "server/jobs.h"
#include "server/mesh_chunks.h"
#include "server/options.h"
#include "server/progress_pacer.h"
#include "spdlog/logger.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// What meshes: core::MeshPoints, or what a test puts in its place.
using Mesher =
    std::function<absl::StatusOr<core::Mesh>(const core::MeshParameters&, std::span<const double>, core::RunContext&)>;

// What all calls of a service share; outlives them.
struct CallEnvironment {
  const ServiceOptions& options;
  const Mesher& mesher;
  JobPool& jobs;
  Background& background;
  CallRegistry& calls;
  spdlog::logger& log;
};

// The reactor of one call. Its requests go to a CloudReceiver; at their end a job is queued; a tick of the background thread looks at the
// job's progress; the finished mesh is cut into chunks by the background thread, at most kChunksAhead before they are written.
//
// Lifetime: held by itself until OnDone, and by whatever else may still call it: its job and tasks of the background thread.
// Thread safety: thread-safe: reactions, the worker, the background thread and Abort may come at the same time.
// Invariants: (1) one write is in flight at most, and Finish is called once, after the last write is done; (2) once ending_ is set, no
// read, write, job or task is started any more; (3) the lock order is this call's mutex, then those of what it uses.
class MeshPointsCall final : public grpc::ServerBidiReactor<v1::MeshPointsRequest, v1::MeshPointsResponse>,
                             public std::enable_shared_from_this<MeshPointsCall> {
 public:
  static constexpr int kChunksAhead = 2;

  // Begins to serve the call of `context`. The call deletes itself.
  static MeshPointsCall* Start(const CallEnvironment& environment, grpc::CallbackServerContext* context);

  // Ends the call with UNAVAILABLE, since the server stops.
  void Abort();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  struct Outcome {
    grpc::Status status;
    std::shared_ptr<const MeshChunks> mesh;  // set when status is OK
  };

  MeshPointsCall(const CallEnvironment& environment, grpc::CallbackServerContext* context);

  // On a worker.
  Outcome Work(PointChunks& points, core::RunContext& context) const;
  void OnJobDone(Outcome outcome);

  // On the background thread.
  void Tick();
  void MakeChunk();

  // The following want mutex_ to be held.
  void SubmitJob();
  void ScheduleTick();
  // Has the next chunk made if there is one and fewer than kChunksAhead are ready.
  void MakeAhead();
  // Writes the next response that is ready, or ends the call when the last one is written.
  void WriteNext();
  // Ends the call with `status`: now, or when the write in flight is done. Only the first call counts.
  void End(grpc::Status status);

  const CallEnvironment& environment_;
  grpc::CallbackServerContext* const context_;  // valid until OnDone
  const std::string peer_;
  const absl::Time start_;
  uint64_t id_ = 0;

  std::mutex mutex_;
  // Guarded by mutex_.
  std::shared_ptr<MeshPointsCall> self_;
  CloudReceiver receiver_;
  v1::MeshPointsRequest request_;    // of the read in flight
  v1::MeshPointsResponse response_;  // of the write in flight
  bool writing_ = false;
  bool ending_ = false;
  grpc::Status final_status_;
  ProgressPacer pacer_;
  std::shared_ptr<Job> job_;  // null before it is queued
  std::shared_ptr<const MeshChunks> mesh_;
  std::deque<v1::MeshPointsResponse> ready_;  // progress, metadata, chunks that wait to be written
  uint64_t next_chunk_ = 0;                   // to be made
  bool making_chunk_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_MESH_POINTS_CALL_H_
