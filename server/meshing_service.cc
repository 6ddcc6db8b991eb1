#include "server/meshing_service.h"

#include <utility>

#include "core/mesher.h"
#include "server/version.h"

namespace wellspace::server {

MeshingService::MeshingService(const ServiceOptions& options, std::shared_ptr<spdlog::logger> log, Mesher mesher)
    : options_(options),
      log_(std::move(log)),
      mesher_(std::move(mesher)),
      jobs_(options_.workers, options_.max_queued_jobs),
      environment_{.options = options_,
                   .mesher = mesher_,
                   .jobs = jobs_,
                   .background = background_,
                   .calls = calls_,
                   .log = *log_} {}

grpc::ServerBidiReactor<v1::MeshPointsRequest, v1::MeshPointsResponse>* MeshingService::MeshPoints(
    grpc::CallbackServerContext* context) {
  return MeshPointsCall::Start(environment_, context);
}

grpc::ServerUnaryReactor* MeshingService::GetServerInfo(grpc::CallbackServerContext* context,
                                                        const v1::GetServerInfoRequest* /*request*/,
                                                        v1::GetServerInfoResponse* response) {
  response->set_version(kVersion);
  for (int dimension = core::kMinDimension; dimension <= core::kMaxDimension; ++dimension) {
    response->add_dimensions(dimension);
  }
  response->set_max_points(options_.max_points);
  response->set_max_vertices(options_.max_vertices);
  response->set_max_request_bytes(kMaxRequestBytes);
  response->set_workers(options_.workers);
  response->set_max_queued_jobs(options_.max_queued_jobs);
  const JobPool::Load load = jobs_.GetLoad();
  response->set_running_jobs(load.running);
  response->set_queued_jobs(load.queued);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace wellspace::server
