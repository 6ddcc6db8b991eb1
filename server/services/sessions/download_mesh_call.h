// One call of DownloadMesh.
#ifndef WELLSPACE_SERVER_SERVICES_SESSIONS_DOWNLOAD_MESH_CALL_H_
#define WELLSPACE_SERVER_SERVICES_SESSIONS_DOWNLOAD_MESH_CALL_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/response_stream.h"
#include "server/log/log_fields.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Sends the mesh that the session has when the call begins, whatever becomes of the session.
//
// Thread safety and invariants: those of ResponseStream.
class DownloadMeshCall final
    : public ResponseStream<Call<grpc::ServerWriteReactor<grpc::ByteBuffer>>, grpc::ByteBuffer> {
 public:
  DownloadMeshCall(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                   const grpc::ByteBuffer& request)
      : ResponseStream(environment, context), bytes_(request) {}

 private:
  void OnBegin() override;
  void OnEnd() override { use_.reset(); }
  LogFields Figures() const override;
  std::optional<grpc::ByteBuffer> NextResponse() override;

  // Wants mutex_ to be held: finds the mesh.
  absl::Status Find();
  // The same: the metadata, then the next chunk.
  absl::StatusOr<grpc::ByteBuffer> MakeResponse();

  // Guarded by mutex_.
  grpc::ByteBuffer bytes_;
  v1::DownloadMeshRequest request_;
  std::optional<SessionUse> use_;
  std::shared_ptr<const MeshSnapshot> mesh_;  // null until found
  bool metadata_sent_ = false;
  uint64_t chunks_ = 0;  // of the mesh, for this call
  uint64_t next_chunk_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSIONS_DOWNLOAD_MESH_CALL_H_
