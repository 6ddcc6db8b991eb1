// One call of DownloadMesh.
#ifndef WELLSPACE_SERVER_SERVICES_SESSIONS_DOWNLOAD_MESH_CALL_H_
#define WELLSPACE_SERVER_SERVICES_SESSIONS_DOWNLOAD_MESH_CALL_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/time/time.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/response_stream.h"
#include "server/jobs/job.h"
#include "server/log/log_fields.h"
#include "server/sessions/session_use.h"
#include "server/store/part_snapshot.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Sends the mesh that the session has when the call begins, a part of it, or the differences that lead to it, whatever
// becomes of the session.
//
// A part is taken out by a job, of which the first of all calls that want as many parts cuts the mesh. While one does
// so, the others have no job and no worker: they come again, as they do where the queue is full.
//
// Thread safety: that of ResponseStream.
// Invariants: those of ResponseStream; at most one job is under way.
class DownloadMeshCall final
    : public ResponseStream<Call<grpc::ServerWriteReactor<grpc::ByteBuffer>>, grpc::ByteBuffer> {
 public:
  DownloadMeshCall(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                   const grpc::ByteBuffer& request)
      : ResponseStream(environment, context), bytes_(request) {}

 private:
  void OnBegin() override;
  void OnEnd() override;
  LogFields Figures() const override;
  std::optional<grpc::ByteBuffer> NextResponse() override;

  // The following want mutex_ to be held.

  // Finds the mesh, and the differences that lead to it.
  absl::Status Find();
  // Refuses a request whatever the session is.
  absl::Status CheckRequest() const;
  // Submits the job that takes the part out, or has that tried again later.
  void WantPart();
  void TryLater();
  // Finds the differences since request_.since_revision().
  absl::Status FindDeltas(const Session& session);
  // Refuses to continue another mesh, or another first difference, than that of this revision.
  absl::Status CheckRevision(uint64_t revision) const;
  // Refuses to begin behind the last chunk.
  absl::Status CheckNextChunk() const;
  // Begins the next part: the mesh, or the next difference.
  absl::Status BeginPart();
  // Whether chunks are those of a difference.
  bool IsDelta() const { return request_.since_revision() != 0; }
  // Of the mesh, or the difference, that is sent now.
  absl::StatusOr<v1::MeshMetadata> Metadata() const;
  // The metadata, then the next chunk.
  absl::StatusOr<grpc::ByteBuffer> MakeResponse();
  core::PartitionOptions Partition() const;

  // On the background thread.
  void TryAgain();
  // On a worker.
  void TakePartIn(Job& job);

  // Guarded by mutex_; constant while the job is under way: request_, use_, mesh_.
  grpc::ByteBuffer bytes_;
  v1::DownloadMeshRequest request_;
  std::optional<SessionUse> use_;
  std::shared_ptr<const MeshSnapshot> mesh_;  // null until found
  std::vector<MeshDeltas::Delta> deltas_;     // to be sent in its place; none: it has not changed
  size_t delta_ = 0;                          // which of them is sent now
  std::shared_ptr<Job> job_;
  absl::Duration retry_delay_ = absl::Milliseconds(20);  // before WantPart is called again; grows
  std::shared_ptr<const PartSnapshot> part_;             // to be sent in the place of the mesh; null until taken
  bool metadata_sent_ = false;
  uint64_t chunks_ = 0;  // of the mesh, or of the difference, for this call
  uint64_t next_chunk_ = 0;
  uint64_t sent_chunks_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSIONS_DOWNLOAD_MESH_CALL_H_
