// AdminService on the client's side.
#include "client/grpc/convert.h"
#include "client/grpc/grpc_connection.h"
#include "core/base/status_macros.h"

namespace wellspace::client {

absl::StatusOr<OwnedOperationPage> GrpcConnection::ListAllOperations(const OperationFilter& filter,
                                                                     const PageOptions& page, const CallOptions& call) {
  v1::ListAllOperationsRequest request;
  request.set_tenant(filter.tenant);
  if (filter.state.has_value()) {
    request.set_state(StateToProto(*filter.state));
  }
  SetPage(page, request);
  v1::ListAllOperationsResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      Call(*servers_.first().admin, &v1::AdminService::Stub::ListAllOperations, request, call, &response));
  OwnedOperationPage result;
  for (const v1::OwnedOperation& owned : response.operations()) {
    result.operations.push_back({.operation = OperationFromProto(owned.operation()),
                                 .tenant = owned.tenant(),
                                 .replica = owned.replica(),
                                 .address = owned.address()});
  }
  WELLSPACE_RETURN_IF_ERROR(CheckNextPage(page.page_token, response.next_page_token()));
  result.next_page_token = response.next_page_token();
  return result;
}

absl::StatusOr<Operation> GrpcConnection::CancelAnyOperation(const std::string& operation, const CallOptions& call) {
  v1::CancelAnyOperationRequest request;
  request.set_name(operation);
  v1::CancelAnyOperationResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(operation, &Server::admin, &v1::AdminService::Stub::CancelAnyOperation, request, call, &response));
  return OperationFromProto(response.operation());
}

absl::StatusOr<absl::Duration> GrpcConnection::DrainServer(const CallOptions& call) {
  v1::DrainServerResponse response;
  // Not repeated: where the answer was lost, another server, or the next process, may be at the address.
  WELLSPACE_RETURN_IF_ERROR(retrier_.Run(call.timeout, call.stop, [&](Attempt& attempt) {
    CallContext context(attempt);
    return attempt.Final(
        FromGrpcStatus(servers_.first().admin->DrainServer(context.get(), v1::DrainServerRequest(), &response)));
  }));
  return DurationFromProto(response.grace());
}

absl::StatusOr<UsagePage> GrpcConnection::GetUsage(const UsageFilter& filter, const PageOptions& page,
                                                   const CallOptions& call) {
  v1::GetUsageRequest request;
  request.set_tenant(filter.tenant);
  request.set_first_day(filter.first_day);
  request.set_last_day(filter.last_day);
  SetPage(page, request);
  v1::GetUsageResponse response;
  WELLSPACE_RETURN_IF_ERROR(Call(*servers_.first().admin, &v1::AdminService::Stub::GetUsage, request, call, &response));
  UsagePage result;
  for (const v1::TenantUsage& usage : response.usage()) {
    result.usage.push_back({.tenant = usage.tenant(),
                            .meshes = usage.meshes(),
                            .vertices = usage.vertices(),
                            .processor_time = DurationFromProto(usage.processor_time()),
                            .sessions = usage.sessions(),
                            .stored_bytes = usage.stored_bytes()});
  }
  WELLSPACE_RETURN_IF_ERROR(CheckNextPage(page.page_token, response.next_page_token()));
  result.next_page_token = response.next_page_token();
  return result;
}

}  // namespace wellspace::client
