#include "server/services/operations/operation_service.h"

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/calls/unary_call.h"
#include "server/services/operations/watch_operation_call.h"
#include "server/services/page_token.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/refinement.h"

namespace wellspace::server {
namespace {

absl::Status Start(const CallEnvironment& environment, const Caller& caller, const v1::StartRefinementRequest& request,
                   const IdentifiedRequest& identified, v1::StartRefinementResponse& response) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<Session> session, FindSession(environment, caller, request.name()));
  core::MeshParameters parameters = *session->state()->parameters;
  if (request.has_parameters()) {
    WELLSPACE_ASSIGN_OR_RETURN(parameters, ParametersForSession(request.parameters(), environment.options, *session));
  }
  const auto answer = [&](const v1::Operation& started) {
    *response.mutable_operation() = started;
    return identified.Answer(response);
  };
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t expected_revision, ExpectedRevisionOf(request));
  return StartRefinement(environment, session, parameters, request.restart(), expected_revision, answer).status();
}

absl::Status Get(const CallEnvironment& environment, const Caller& caller, const v1::GetOperationRequest& request,
                 v1::Operation* operation) {
  WELLSPACE_ASSIGN_OR_RETURN(const FoundOperation found, FindOperation(environment, caller, request.name()));
  WELLSPACE_ASSIGN_OR_RETURN(*operation, found.session->Tell(*found.operation));
  return absl::OkStatus();
}

absl::Status Cancel(const CallEnvironment& environment, const Caller& caller, const v1::CancelOperationRequest& request,
                    v1::Operation* cancelled) {
  WELLSPACE_ASSIGN_OR_RETURN(const FoundOperation found, FindOperation(environment, caller, request.name()));
  WELLSPACE_RETURN_IF_ERROR(CancelOperation(environment, *found.session, *found.operation));
  WELLSPACE_ASSIGN_OR_RETURN(*cancelled, found.session->Tell(*found.operation));
  return absl::OkStatus();
}

absl::Status List(const CallEnvironment& environment, const Caller& caller, const v1::ListOperationsRequest& request,
                  v1::ListOperationsResponse& response) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<Session> session,
                             FindSession(environment, caller, request.parent(), "parent"));
  WELLSPACE_ASSIGN_OR_RETURN(const size_t count, PageSizeOf(request));
  const std::string list = absl::StrCat("operations of ", session->name());
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t after, NumberFromProto(request.page_token(), list));
  const std::vector<std::shared_ptr<Operation>> operations = session->ListOperations(after, count + 1);
  const size_t listed = FillPage(operations, count, response.mutable_operations());
  if (listed < operations.size()) {
    response.set_next_page_token(MakePageToken(list, PositionOf(operations[listed - 1]->number())));
  }
  return session->IsElsewhere() ? Elsewhere(session->name()) : absl::OkStatus();
}

}  // namespace

grpc::ServerUnaryReactor* OperationService::StartRefinement(grpc::CallbackServerContext* context,
                                                            const v1::StartRefinementRequest* request,
                                                            v1::StartRefinementResponse* response) {
  return UnaryCall::ServeOnce(
      environment_, context, request, response, request->name(),
      [this](const Caller& caller, const v1::StartRefinementRequest& own, const IdentifiedRequest& identified,
             v1::StartRefinementResponse& answer) { return Start(environment_, caller, own, identified, answer); });
}

grpc::ServerUnaryReactor* OperationService::GetOperation(grpc::CallbackServerContext* context,
                                                         const v1::GetOperationRequest* request,
                                                         v1::GetOperationResponse* response) {
  return UnaryCall::Serve(environment_, context, response,
                          [this, request](const Caller& caller, v1::GetOperationResponse& answer) {
                            return Get(environment_, caller, *request, answer.mutable_operation());
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
  return UnaryCall::ServeChange(
      environment_, context, request, response, SessionOf(request->name()),
      [this](const Caller& caller, const v1::CancelOperationRequest& own, v1::CancelOperationResponse& answer) {
        return Cancel(environment_, caller, own, answer.mutable_operation());
      });
}

grpc::ServerWriteReactor<v1::WatchOperationResponse>* OperationService::WatchOperation(
    grpc::CallbackServerContext* context, const v1::WatchOperationRequest* request) {
  return WatchOperationCall::Begin(std::make_shared<WatchOperationCall>(environment_, context, *request));
}

}  // namespace wellspace::server
