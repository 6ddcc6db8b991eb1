// wellspace.v1.MeshingService: translates calls into jobs.
#ifndef WELLSPACE_SERVER_MESHING_SERVICE_H_
#define WELLSPACE_SERVER_MESHING_SERVICE_H_

#include <memory>

#include "server/authenticator.h"
#include "server/background.h"
#include "server/call_environment.h"
#include "server/call_registry.h"
#include "server/jobs.h"
#include "server/memory_budget.h"
#include "server/options.h"
#include "spdlog/logger.h"
#include "wellspace/v1/meshing.grpc.pb.h"

namespace wellspace::server {

// The service and the threads that work for it. Streams are read and written as bytes: see ParseRequest and SerializeChunk.
//
// Thread safety: thread-safe.
// REQUIRES:   the gRPC server has ended all calls before this is destroyed.
class MeshingService final
    : public v1::MeshingService::WithRawCallbackMethod_MeshPoints<
          v1::MeshingService::WithRawCallbackMethod_EstimateMesh<
              v1::MeshingService::WithCallbackMethod_GetServerInfo<v1::MeshingService::Service>>> {
 public:
  // `authenticator` outlives this.
  MeshingService(const ServiceOptions& options, const Authenticator& authenticator, std::shared_ptr<spdlog::logger> log,
                 Mesher mesher, Estimator estimator);

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* MeshPoints(
      grpc::CallbackServerContext* context) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* EstimateMesh(grpc::CallbackServerContext* context,
                                                          grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context, const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;

  // The calls that take a cloud and are under way.
  CallRegistry& calls() { return calls_; }

 private:
  const ServiceOptions options_;
  const std::shared_ptr<spdlog::logger> log_;
  const Mesher mesher_;
  const Estimator estimator_;
  const Authenticator& authenticator_;
  CallRegistry calls_;
  MemoryBudget memory_;
  // Jobs end before the background thread, to which they post.
  Background background_;
  JobPool jobs_;
  const CallEnvironment environment_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_MESHING_SERVICE_H_
