// wellspace.v1.OperationService: starts, shows, watches and cancels operations.
#ifndef WELLSPACE_SERVER_SERVICES_OPERATIONS_OPERATION_SERVICE_H_
#define WELLSPACE_SERVER_SERVICES_OPERATIONS_OPERATION_SERVICE_H_

#include "server/calls/call_environment.h"
#include "wellspace/v1/operations.grpc.pb.h"

namespace wellspace::server {

// Thread safety: thread-safe.
class OperationService final : public v1::OperationService::CallbackService {
 public:
  // REQUIRES:   `environment` outlives this.
  explicit OperationService(const CallEnvironment& environment) : environment_(environment) {}

  grpc::ServerUnaryReactor* StartRefinement(grpc::CallbackServerContext* context,
                                            const v1::StartRefinementRequest* request,
                                            v1::StartRefinementResponse* response) override;
  grpc::ServerUnaryReactor* GetOperation(grpc::CallbackServerContext* context, const v1::GetOperationRequest* request,
                                         v1::GetOperationResponse* response) override;
  grpc::ServerUnaryReactor* ListOperations(grpc::CallbackServerContext* context,
                                           const v1::ListOperationsRequest* request,
                                           v1::ListOperationsResponse* response) override;
  grpc::ServerUnaryReactor* CancelOperation(grpc::CallbackServerContext* context,
                                            const v1::CancelOperationRequest* request,
                                            v1::CancelOperationResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchOperationResponse>* WatchOperation(
      grpc::CallbackServerContext* context, const v1::WatchOperationRequest* request) override;

 private:
  const CallEnvironment& environment_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_OPERATIONS_OPERATION_SERVICE_H_
