#include "server/meshing_service.h"

#include <memory>
#include <utility>

#include "core/mesher.h"
#include "server/convert.h"
#include "server/estimate_mesh_call.h"
#include "server/mesh_points_call.h"
#include "server/version.h"

namespace wellspace::server {

MeshingService::MeshingService(const ServiceOptions& options, const Authenticator& authenticator,
                               std::shared_ptr<spdlog::logger> log, Mesher mesher, Estimator estimator)
    : options_(options),
      log_(std::move(log)),
      mesher_(std::move(mesher)),
      estimator_(std::move(estimator)),
      authenticator_(authenticator),
      memory_(options_.max_memory_bytes),
      jobs_({.workers = options_.workers,
             .max_queued = options_.max_queued_jobs,
             .max_per_tenant = options_.max_jobs_per_tenant},
            memory_),
      environment_{.options = options_,
                   .mesher = mesher_,
                   .estimator = estimator_,
                   .authenticator = authenticator_,
                   .memory = memory_,
                   .jobs = jobs_,
                   .background = background_,
                   .calls = calls_,
                   .log = *log_} {}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* MeshingService::MeshPoints(
    grpc::CallbackServerContext* context) {
  return MeshPointsCall::Begin(std::make_shared<MeshPointsCall>(environment_, context));
}

grpc::ServerReadReactor<grpc::ByteBuffer>* MeshingService::EstimateMesh(grpc::CallbackServerContext* context,
                                                                        grpc::ByteBuffer* response) {
  return EstimateMeshCall::Begin(std::make_shared<EstimateMeshCall>(environment_, context, response));
}

grpc::ServerUnaryReactor* MeshingService::GetServerInfo(grpc::CallbackServerContext* context,
                                                        const v1::GetServerInfoRequest* /*request*/,
                                                        v1::GetServerInfoResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  Caller caller;
  if (const grpc::Status status = authenticator_.Authenticate(*context, &caller); !status.ok()) {
    reactor->Finish(status);
    return reactor;
  }
  response->set_version(kVersion);
  for (int dimension = core::kMinDimension; dimension <= core::kMaxDimension; ++dimension) {
    response->add_dimensions(dimension);
  }
  response->set_max_points(options_.max_points);
  response->set_max_vertices(options_.max_vertices);
  response->set_max_request_bytes(kMaxRequestBytes);
  response->set_workers(options_.workers);
  response->set_max_queued_jobs(options_.max_queued_jobs);
  response->set_max_sessions(options_.max_sessions);
  response->set_max_sessions_per_tenant(options_.max_sessions_per_tenant);
  *response->mutable_default_ttl() = DurationToProto(options_.default_ttl);
  *response->mutable_max_ttl() = DurationToProto(options_.max_ttl);
  *response->mutable_stall_limit() = DurationToProto(options_.stall_limit);
  response->set_max_memory_bytes(options_.max_memory_bytes);
  const JobPool::Load load = jobs_.GetLoad();
  response->set_running_jobs(load.running);
  response->set_queued_jobs(load.queued);
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace wellspace::server
