#include "server/services/admin/admin_service.h"

#include <iterator>
#include <limits>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/time/civil_time.h"
#include "core/base/status_macros.h"
#include "server/calls/unary_call.h"
#include "server/services/admin/list_operations.h"
#include "server/services/page_token.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/refinement.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr size_t kMostShown = 32;  // bytes of a wrong day in a message

absl::Status CheckAdmin(const Caller& caller) {
  return caller.is_admin
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_ADMIN_ONLY,
                         "this call wants the token of an admin; `wellspaced hash-token --admin` makes the line of the "
                         "server's --token-file that declares one");
}

absl::Status Cancel(const CallEnvironment& environment, const v1::CancelAnyOperationRequest& request,
                    v1::Operation* cancelled) {
  WELLSPACE_ASSIGN_OR_RETURN(const FoundOperation found, FindOperationOfAnyTenant(environment, request.name()));
  WELLSPACE_RETURN_IF_ERROR(CancelOperation(environment, *found.session, *found.operation));
  WELLSPACE_ASSIGN_OR_RETURN(*cancelled, found.session->Tell(*found.operation));
  return absl::OkStatus();
}

// The day `text`, since 1970; `none` if it is empty.
absl::StatusOr<int64_t> DayFromProto(const std::string& text, const char* field, int64_t none) {
  if (text.empty()) {
    return none;
  }
  absl::CivilDay day;
  // Other forms of a day are read, too.
  if (!absl::ParseCivilTime(text, &day) || absl::FormatCivilTime(day) != text) {
    return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                     absl::StrCat(field, " is \"", absl::Utf8SafeCHexEscape(text.substr(0, kMostShown)),
                                  "\"; expected a day as \"2026-01-31\", or nothing"),
                     field);
  }
  return day - absl::CivilDay(1970);
}

absl::Status Tell(const CallEnvironment& environment, const v1::GetUsageRequest& request,
                  v1::GetUsageResponse& response) {
  UsageRange range{.tenant = request.tenant()};
  WELLSPACE_RETURN_IF_ERROR(CheckTenant(request.tenant()));
  WELLSPACE_ASSIGN_OR_RETURN(range.first_day, DayFromProto(request.first_day(), "first_day", range.first_day));
  WELLSPACE_ASSIGN_OR_RETURN(range.last_day, DayFromProto(request.last_day(), "last_day", range.last_day));
  WELLSPACE_ASSIGN_OR_RETURN(const size_t count, PageSizeOf(request));
  const std::string list = absl::StrCat("usage ", request.first_day(), " ", request.last_day(), " ", request.tenant());
  WELLSPACE_ASSIGN_OR_RETURN(const std::string after, PositionFromProto(request.page_token(), list));
  WELLSPACE_ASSIGN_OR_RETURN(const UsageByTenant usage, environment.session_log.records().ReadUsage(range));
  auto next = usage.upper_bound(after);
  for (; next != usage.end() && response.usage_size() < static_cast<int>(count); ++next) {
    v1::TenantUsage& told = *response.add_usage();
    told.set_tenant(next->first);
    told.set_meshes(next->second.meshes);
    told.set_vertices(next->second.vertices);
    *told.mutable_processor_time() = DurationToProto(absl::Nanoseconds(next->second.processor_time_ns));
    told.set_sessions(next->second.sessions);
    told.set_stored_bytes(next->second.stored_bytes);
  }
  if (next != usage.end()) {
    response.set_next_page_token(MakePageToken(list, std::prev(next)->first));
  }
  return absl::OkStatus();
}

}  // namespace

template <typename Request, typename Response, typename Handler>
grpc::ServerUnaryReactor* AdminService::Serve(grpc::CallbackServerContext* context, const Request* request,
                                              Response* response, const std::string& key, const Handler& handler) {
  return UnaryCall::ServeChange(environment_, context, request, response, key,
                                [handler](const Caller& caller, const Request& own, Response& answer) -> absl::Status {
                                  WELLSPACE_RETURN_IF_ERROR(CheckAdmin(caller));
                                  return handler(own, answer);
                                });
}

grpc::ServerUnaryReactor* AdminService::ListAllOperations(grpc::CallbackServerContext* context,
                                                          const v1::ListAllOperationsRequest* request,
                                                          v1::ListAllOperationsResponse* response) {
  return Serve(context, request, response, "",
               [this](const v1::ListAllOperationsRequest& own, v1::ListAllOperationsResponse& answer) {
                 return server::ListAllOperations(environment_, own, answer);
               });
}

grpc::ServerUnaryReactor* AdminService::CancelAnyOperation(grpc::CallbackServerContext* context,
                                                           const v1::CancelAnyOperationRequest* request,
                                                           v1::CancelAnyOperationResponse* response) {
  return Serve(context, request, response, SessionOf(request->name()),
               [this](const v1::CancelAnyOperationRequest& own, v1::CancelAnyOperationResponse& answer) {
                 return Cancel(environment_, own, answer.mutable_operation());
               });
}

// A second signal would end the process at once: only the first call sends one.
grpc::ServerUnaryReactor* AdminService::DrainServer(grpc::CallbackServerContext* context,
                                                    const v1::DrainServerRequest* request,
                                                    v1::DrainServerResponse* response) {
  return Serve(context, request, response, "",
               [this](const v1::DrainServerRequest&, v1::DrainServerResponse& answer) -> absl::Status {
                 if (environment_.options.begin_drain == nullptr) {
                   return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                                    "this server is a part of another program, which ends it");
                 }
                 *answer.mutable_grace() = DurationToProto(environment_.options.grace);
                 if (!is_draining_.exchange(true)) {
                   environment_.options.begin_drain();
                 }
                 return absl::OkStatus();
               });
}

grpc::ServerUnaryReactor* AdminService::GetUsage(grpc::CallbackServerContext* context,
                                                 const v1::GetUsageRequest* request, v1::GetUsageResponse* response) {
  return Serve(context, request, response, "", [this](const v1::GetUsageRequest& own, v1::GetUsageResponse& answer) {
    return Tell(environment_, own, answer);
  });
}

}  // namespace wellspace::server
