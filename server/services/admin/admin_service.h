// wellspace.v1.AdminService: the work and the usage of all tenants, and the end of the server.
#ifndef WELLSPACE_SERVER_SERVICES_ADMIN_ADMIN_SERVICE_H_
#define WELLSPACE_SERVER_SERVICES_ADMIN_ADMIN_SERVICE_H_

#include <atomic>

#include "server/calls/call_environment.h"
#include "wellspace/v1/admin.grpc.pb.h"

namespace wellspace::server {

// Every call is refused whose caller is no admin.
//
// Thread safety: thread-safe.
class AdminService final : public v1::AdminService::CallbackService {
 public:
  // REQUIRES:   `environment` outlives this.
  explicit AdminService(const CallEnvironment& environment) : environment_(environment) {}

  grpc::ServerUnaryReactor* ListAllOperations(grpc::CallbackServerContext* context,
                                              const v1::ListAllOperationsRequest* request,
                                              v1::ListAllOperationsResponse* response) override;
  grpc::ServerUnaryReactor* CancelAnyOperation(grpc::CallbackServerContext* context,
                                               const v1::CancelAnyOperationRequest* request,
                                               v1::CancelAnyOperationResponse* response) override;
  grpc::ServerUnaryReactor* DrainServer(grpc::CallbackServerContext* context, const v1::DrainServerRequest* request,
                                        v1::DrainServerResponse* response) override;
  grpc::ServerUnaryReactor* GetUsage(grpc::CallbackServerContext* context, const v1::GetUsageRequest* request,
                                     v1::GetUsageResponse* response) override;

 private:
  // Serves a call of an admin: absl::Status handler(const Request&, Response&), on a thread that may wait. `key` as of
  // UnaryCall::ServeChange.
  template <typename Request, typename Response, typename Handler>
  grpc::ServerUnaryReactor* Serve(grpc::CallbackServerContext* context, const Request* request, Response* response,
                                  const std::string& key, const Handler& handler);

  const CallEnvironment& environment_;
  std::atomic<bool> is_draining_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_ADMIN_ADMIN_SERVICE_H_
