#include "server/services/meshing/meshing_service.h"

#include <memory>

#include "core/meshers/mesher.h"
#include "server/base/version.h"
#include "server/security/authenticator.h"
#include "server/services/meshing/estimate_mesh_call.h"
#include "server/services/meshing/mesh_points_call.h"
#include "server/sessions/session_registry.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

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
  const absl::StatusOr<Caller> caller = environment_.authenticator.Authenticate(*context);
  if (!caller.ok()) {
    reactor->Finish(ToGrpcStatus(caller.status()));
    return reactor;
  }
  response->set_version(kVersion);
  for (int dimension = core::kMinDimension; dimension <= core::kMaxDimension; ++dimension) {
    response->add_dimensions(dimension);
  }
  response->set_max_points(environment_.options.max_points);
  response->set_max_vertices(environment_.options.max_vertices);
  response->set_max_request_bytes(kMaxRequestBytes);
  response->set_workers(environment_.options.workers);
  response->set_max_queued_jobs(environment_.options.max_queued_jobs);
  response->set_max_sessions(environment_.options.max_sessions);
  response->set_max_sessions_per_tenant(environment_.options.max_sessions_per_tenant);
  *response->mutable_default_ttl() = DurationToProto(environment_.options.default_ttl);
  *response->mutable_max_ttl() = DurationToProto(environment_.options.max_ttl);
  *response->mutable_stall_limit() = DurationToProto(environment_.options.stall_limit);
  response->set_max_memory_bytes(environment_.options.max_memory_bytes);
  response->set_max_stored_bytes_per_tenant(environment_.options.max_stored_bytes_per_tenant);
  response->set_stored_bytes(environment_.sessions.StoredBytes(caller->tenant));
  const JobPool::Load load = environment_.jobs.GetLoad();
  response->set_running_jobs(load.running);
  response->set_queued_jobs(load.queued);
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace wellspace::server
