// One call of MeshPoints.
#ifndef WELLSPACE_SERVER_MESH_POINTS_CALL_H_
#define WELLSPACE_SERVER_MESH_POINTS_CALL_H_

#include <cstdint>
#include <deque>
#include <memory>

#include "grpcpp/support/server_callback.h"
#include "server/cloud_call.h"
#include "server/mesh_chunks.h"
#include "server/progress_pacer.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// A CloudCall whose job meshes. A tick of the background thread looks at the job's progress; the finished mesh is cut into chunks by
// the background thread, at most kChunksAhead before they are written.
//
// Invariants: those of CloudCall, and one write is in flight at most.
class MeshPointsCall final
    : public CloudCall<grpc::ServerBidiReactor<v1::MeshPointsRequest, v1::MeshPointsResponse>, v1::MeshPointsRequest> {
 public:
  static constexpr int kChunksAhead = 2;

  // Begins to serve the call of `context`. The call deletes itself.
  static MeshPointsCall* Start(const CallEnvironment& environment, grpc::CallbackServerContext* context);

  void OnWriteDone(bool ok) override;

 private:
  MeshPointsCall(const CallEnvironment& environment, grpc::CallbackServerContext* context)
      : CloudCall(environment, context, "MeshPoints") {}

  void Work(PointChunks& points, Job& job) override;
  void OnParameters() override { ScheduleTick(); }
  bool IsWriting() const override { return writing_; }
  void DropAnswer() override { ready_.clear(); }
  uint64_t VertexCount() const override { return mesh_ == nullptr ? 0 : mesh_->mesh().vertex_count(); }

  // On the background thread.
  void Tick();
  void MakeChunk();

  // The following want mutex_ to be held.
  void ScheduleTick();
  // Has the next chunk made if there is one and fewer than kChunksAhead are ready.
  void MakeAhead();
  // Writes the next response that is ready, or ends the call when the last one is written.
  void WriteNext();

  std::shared_ptr<MeshPointsCall> Self() { return std::static_pointer_cast<MeshPointsCall>(shared_from_this()); }

  // Guarded by mutex_.
  v1::MeshPointsResponse response_;  // of the write in flight
  bool writing_ = false;
  ProgressPacer pacer_;
  std::shared_ptr<const MeshChunks> mesh_;
  std::deque<v1::MeshPointsResponse> ready_;  // progress, metadata, chunks that wait to be written
  uint64_t next_chunk_ = 0;                   // to be made
  bool making_chunk_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_MESH_POINTS_CALL_H_
