// wellspace.v1.MeshingService: translates calls into jobs.
#ifndef WELLSPACE_SERVER_SERVICES_MESHING_MESHING_SERVICE_H_
#define WELLSPACE_SERVER_SERVICES_MESHING_MESHING_SERVICE_H_

#include "server/calls/call_environment.h"
#include "wellspace/v1/meshing.grpc.pb.h"

namespace wellspace::server {

// Streams are read and written as bytes: see ParseRequest and SerializeChunk.
//
// Thread safety: thread-safe.
class MeshingService final
    : public v1::MeshingService::WithRawCallbackMethod_MeshPoints<
          v1::MeshingService::WithRawCallbackMethod_EstimateMesh<
              v1::MeshingService::WithCallbackMethod_GetServerInfo<v1::MeshingService::Service>>> {
 public:
  // REQUIRES:   `environment` outlives this.
  explicit MeshingService(const CallEnvironment& environment) : environment_(environment) {}

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* MeshPoints(
      grpc::CallbackServerContext* context) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* EstimateMesh(grpc::CallbackServerContext* context,
                                                          grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context, const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;

 private:
  const CallEnvironment& environment_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_MESHING_MESHING_SERVICE_H_
