// One call of EstimateMesh.
#ifndef WELLSPACE_SERVER_SERVICES_MESHING_ESTIMATE_MESH_CALL_H_
#define WELLSPACE_SERVER_SERVICES_MESHING_ESTIMATE_MESH_CALL_H_

#include <cstdint>

#include "grpcpp/support/server_callback.h"
#include "server/services/meshing/cloud_call.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// A CloudCall whose job estimates, and whose answer is one message.
class EstimateMeshCall final : public CloudCall<grpc::ServerReadReactor<grpc::ByteBuffer>, v1::EstimateMeshRequest> {
 public:
  // REQUIRES:   `response` is valid until the end of the call.
  EstimateMeshCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, grpc::ByteBuffer* response)
      : CloudCall(environment, context), response_(response) {}

 private:
  void Work(NumberChunks& points, Job& job) override;
  bool IsSmall(const NumberChunks& points) const override;
  uint64_t VertexCount() const override { return vertices_; }

  grpc::ByteBuffer* const response_;  // guarded by mutex_; gRPC's from Finish on
  uint64_t vertices_ = 0;             // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_MESHING_ESTIMATE_MESH_CALL_H_
