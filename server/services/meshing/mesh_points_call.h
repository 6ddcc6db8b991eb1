// One call of MeshPoints.
#ifndef WELLSPACE_SERVER_SERVICES_MESHING_MESH_POINTS_CALL_H_
#define WELLSPACE_SERVER_SERVICES_MESHING_MESH_POINTS_CALL_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/response_stream.h"
#include "server/services/meshing/cloud_call.h"
#include "server/sessions/progress_pacer.h"
#include "server/store/mesh_chunks.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// A CloudCall whose job meshes. A tick of the background thread looks at the job's progress; the finished mesh is sent
// chunk by chunk, each made when it can be written.
//
// Thread safety and invariants: those of ResponseStream.
class MeshPointsCall final
    : public ResponseStream<
          CloudCall<grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>, v1::MeshPointsRequest>,
          grpc::ByteBuffer> {
 public:
  MeshPointsCall(const CallEnvironment& environment, grpc::CallbackServerContext* context)
      : ResponseStream(environment, context) {}

 private:
  void Work(NumberChunks& points, Job& job) override;
  bool IsSmall(const NumberChunks& points) const override;
  void OnParameters(const v1::MeshPointsRequest& request) override {
    with_boundary_ = request.with_boundary();
    ScheduleTick();
  }
  uint64_t VertexCount() const override { return mesh_ == nullptr ? 0 : mesh_->mesh().vertex_count(); }
  std::optional<grpc::ByteBuffer> NextResponse() override;

  // On the background thread.
  void Tick();
  // Wants mutex_ to be held.
  void ScheduleTick();

  // Guarded by mutex_.
  ProgressPacer pacer_;
  std::optional<v1::ProgressEvent> event_;  // that waits to be written
  std::shared_ptr<const MeshChunks> mesh_;
  bool with_boundary_ = false;  // as was asked for
  bool metadata_sent_ = false;
  uint64_t next_chunk_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_MESHING_MESH_POINTS_CALL_H_
