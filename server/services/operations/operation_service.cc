#include "server/services/operations/operation_service.h"

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/calls/unary_call.h"
#include "server/services/operations/watch_operation_call.h"
#include "server/services/page_token.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/refinement.h"

namespace wellspace::server {
namespace {

grpc::Status Start(const CallEnvironment& environment, const Caller& caller, const v1::StartRefinementRequest& request,
                   v1::Operation* started) {
  std::shared_ptr<Session> session;
  if (grpc::Status status = FindSession(environment, caller, request.name(), &session); !status.ok()) {
    return status;
  }
  core::MeshParameters parameters = session->parameters();
  if (request.has_parameters()) {
    if (grpc::Status status = ParametersForSession(request.parameters(), environment.options, *session, &parameters);
        !status.ok()) {
      return status;
    }
  }
  std::shared_ptr<Operation> operation;
  if (grpc::Status status = StartRefinement(environment, session, parameters, request.expected_revision(), &operation);
      !status.ok()) {
    return status;
  }
  *started = operation->Describe();
  return grpc::Status::OK;
}

grpc::Status List(const CallEnvironment& environment, const Caller& caller, const v1::ListOperationsRequest& request,
                  v1::ListOperationsResponse& response) {
  std::shared_ptr<Session> session;
  if (grpc::Status status = FindSession(environment, caller, request.parent(), &session, "parent"); !status.ok()) {
    return status;
  }
  size_t count = 0;
  if (grpc::Status status = PageSizeFromProto(request.page_size(), &count); !status.ok()) {
    return status;
  }
  const std::string list = absl::StrCat("operations of ", session->name());
  uint64_t after = 0;
  if (grpc::Status status = PositionFromProto(request.page_token(), list, 0, &after); !status.ok()) {
    return status;
  }
  const std::vector<std::shared_ptr<Operation>> operations = session->ListOperations(after, count + 1);
  const size_t listed = FillPage(operations, count, response.mutable_operations());
  if (listed < operations.size()) {
    response.set_next_page_token(MakePageToken(list, operations[listed - 1]->number()));
  }
  return grpc::Status::OK;
}

}  // namespace

grpc::ServerUnaryReactor* OperationService::StartRefinement(grpc::CallbackServerContext* context,
                                                            const v1::StartRefinementRequest* request,
                                                            v1::StartRefinementResponse* response) {
  return UnaryCall::ServeOnce(environment_, context, request, response,
                              [this, request](const Caller& caller, v1::StartRefinementResponse& answer) {
                                return Start(environment_, caller, *request, answer.mutable_operation());
                              });
}

grpc::ServerUnaryReactor* OperationService::GetOperation(grpc::CallbackServerContext* context,
                                                         const v1::GetOperationRequest* request,
                                                         v1::GetOperationResponse* response) {
  return UnaryCall::Serve(environment_, context, response,
                          [this, request](const Caller& caller, v1::GetOperationResponse& answer) {
                            FoundOperation found;
                            grpc::Status status = FindOperation(environment_, caller, request->name(), &found);
                            if (status.ok()) {
                              *answer.mutable_operation() = found.operation->Describe();
                            }
                            return status;
                          });
}

grpc::ServerUnaryReactor* OperationService::ListOperations(grpc::CallbackServerContext* context,
                                                           const v1::ListOperationsRequest* request,
                                                           v1::ListOperationsResponse* response) {
  return UnaryCall::Serve(environment_, context, response,
                          [this, request](const Caller& caller, v1::ListOperationsResponse& answer) {
                            return List(environment_, caller, *request, answer);
                          });
}

grpc::ServerUnaryReactor* OperationService::CancelOperation(grpc::CallbackServerContext* context,
                                                            const v1::CancelOperationRequest* request,
                                                            v1::CancelOperationResponse* response) {
  return UnaryCall::Serve(environment_, context, response,
                          [this, request](const Caller& caller, v1::CancelOperationResponse& answer) {
                            FoundOperation found;
                            grpc::Status status = FindOperation(environment_, caller, request->name(), &found);
                            if (status.ok()) {
                              server::CancelOperation(environment_, *found.session, *found.operation);
                              *answer.mutable_operation() = found.operation->Describe();
                            }
                            return status;
                          });
}

grpc::ServerWriteReactor<v1::WatchOperationResponse>* OperationService::WatchOperation(
    grpc::CallbackServerContext* context, const v1::WatchOperationRequest* request) {
  return WatchOperationCall::Begin(std::make_shared<WatchOperationCall>(environment_, context, *request));
}

}  // namespace wellspace::server
