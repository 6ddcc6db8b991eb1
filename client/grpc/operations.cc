// OperationService on the client's side.
#include "client/grpc/convert.h"
#include "client/grpc/grpc_connection.h"
#include "core/base/status_macros.h"

namespace wellspace::client {

absl::StatusOr<Operation> GrpcConnection::StartRefinement(const std::string& session,
                                                          const RefinementOptions& refinement,
                                                          const CallOptions& call) {
  v1::StartRefinementRequest request;
  request.set_name(session);
  if (refinement.parameters.has_value()) {
    SetParameters(*refinement.parameters, request.mutable_parameters());
  }
  request.set_restart(refinement.restart);
  request.set_request_id(RequestIdOf(call));
  SetExpectedRevision(call.expected_revision, request);
  v1::StartRefinementResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(session, &Server::operations, &v1::OperationService::Stub::StartRefinement, request, call, &response));
  return OperationFromProto(response.operation());
}

absl::StatusOr<Operation> GrpcConnection::GetOperation(const std::string& operation, const CallOptions& call) {
  v1::GetOperationRequest request;
  request.set_name(operation);
  v1::GetOperationResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(operation, &Server::operations, &v1::OperationService::Stub::GetOperation, request, call, &response));
  return OperationFromProto(response.operation());
}

absl::StatusOr<OperationPage> GrpcConnection::ListOperations(const std::string& session, const PageOptions& page,
                                                             const CallOptions& call) {
  v1::ListOperationsRequest request;
  request.set_parent(session);
  SetPage(page, request);
  v1::ListOperationsResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(session, &Server::operations, &v1::OperationService::Stub::ListOperations, request, call, &response));
  OperationPage result;
  for (const v1::Operation& operation : response.operations()) {
    result.operations.push_back(OperationFromProto(operation));
  }
  WELLSPACE_RETURN_IF_ERROR(CheckNextPage(page.page_token, response.next_page_token()));
  result.next_page_token = response.next_page_token();
  return result;
}

absl::StatusOr<Operation> GrpcConnection::CancelOperation(const std::string& operation, const CallOptions& call) {
  v1::CancelOperationRequest request;
  request.set_name(operation);
  v1::CancelOperationResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(operation, &Server::operations, &v1::OperationService::Stub::CancelOperation, request, call, &response));
  return OperationFromProto(response.operation());
}

absl::StatusOr<Operation> GrpcConnection::WatchOperation(const std::string& operation, const OnProgress& on_progress,
                                                         std::optional<uint64_t> after_sequence,
                                                         const CallOptions& call) {
  std::optional<Operation> ended;
  const absl::Status status = RunOn(operation, call, [&](const Server& server, Attempt& attempt) {
    v1::WatchOperationRequest request;
    request.set_name(operation);
    if (after_sequence.has_value()) {
      request.set_after_sequence(*after_sequence);
    }
    CallContext context(attempt);
    const std::unique_ptr<grpc::ClientReader<v1::WatchOperationResponse>> stream =
        server.operations->WatchOperation(context.get(), request);
    v1::WatchOperationResponse response;
    while (stream->Read(&response)) {
      attempt.NoteProgress();
      if (response.has_operation()) {
        ended = OperationFromProto(response.operation());
      } else if (response.has_progress()) {
        after_sequence = response.progress().sequence();
        if (on_progress != nullptr) {
          on_progress(ProgressFromProto(response.progress()));
        }
      }
    }
    const absl::Status end = FromGrpcStatus(stream->Finish());
    if (ended.has_value()) {
      return absl::OkStatus();
    }
    return end.ok() ? attempt.Final(absl::DataLossError("the server ended the watch without the operation's end"))
                    : end;
  });
  if (!status.ok()) {
    return status;
  }
  return *std::move(ended);
}

}  // namespace wellspace::client
