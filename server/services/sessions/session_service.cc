#include "server/services/sessions/session_service.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"
#include "server/calls/unary_call.h"
#include "server/jobs/memory_budget.h"
#include "server/services/page_token.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/services/sessions/add_features_call.h"
#include "server/services/sessions/download_mesh_call.h"
#include "server/services/sessions/set_sizes_call.h"
#include "server/services/sessions/upload_points_call.h"
#include "server/sessions/refinement.h"
#include "server/sessions/session_registry.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

absl::Status Create(const CallEnvironment& environment, const Caller& caller, const v1::CreateSessionRequest& request,
                    const IdentifiedRequest& identified, v1::CreateSessionResponse& response) {
  NewSession settings{.tenant = caller.tenant, .parameters = {}, .labels = {}, .ttl = {}};
  WELLSPACE_ASSIGN_OR_RETURN(settings.parameters, ParametersFromProto(request.parameters(), environment.options));
  WELLSPACE_RETURN_IF_ERROR(CheckParametersSize(settings.parameters));
  WELLSPACE_ASSIGN_OR_RETURN(settings.labels, LabelsFromProto(request.labels(), "labels"));
  WELLSPACE_ASSIGN_OR_RETURN(settings.ttl,
                             TtlFromProto(request.has_ttl() ? &request.ttl() : nullptr, "ttl", environment.options));
  return environment.sessions
      .Create(std::move(settings),
              [&](const v1::Session& created) {
                *response.mutable_session() = created;
                return identified.Answer(response);
              })
      .status();
}

// The name of the list that page tokens belong to: a token is refused where tenant or labels are others.
std::string ListOf(const Caller& caller, const Labels& labels) {
  std::string list = absl::StrCat("sessions of ", caller.tenant);
  for (const auto& [key, value] : labels) {
    absl::StrAppend(&list, "|", key.size(), ":", key, value);
  }
  return list;
}

absl::Status List(const CallEnvironment& environment, const Caller& caller, const v1::ListSessionsRequest& request,
                  v1::ListSessionsResponse& response) {
  WELLSPACE_RETURN_IF_ERROR(environment.session_log.records().CheckOwnership());
  WELLSPACE_ASSIGN_OR_RETURN(const size_t count, PageSizeOf(request));
  WELLSPACE_ASSIGN_OR_RETURN(const Labels labels, LabelsFromProto(request.labels(), "labels"));
  const std::string list = ListOf(caller, labels);
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t after, NumberFromProto(request.page_token(), list));
  const std::vector<std::shared_ptr<Session>> sessions =
      environment.sessions.List(caller.tenant, absl::FromUnixNanos(static_cast<int64_t>(after)), count + 1, labels);
  const size_t listed = FillPage(sessions, count, response.mutable_sessions());
  if (listed < sessions.size()) {
    response.set_next_page_token(
        MakePageToken(list, PositionOf(static_cast<uint64_t>(absl::ToUnixNanos(sessions[listed - 1]->create_time())))));
  }
  return absl::OkStatus();
}

absl::Status Update(const CallEnvironment& environment, const Caller& caller, const v1::UpdateSessionRequest& request,
                    const IdentifiedRequest& identified, v1::UpdateSessionResponse& response) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<Session> session,
                             FindSession(environment, caller, request.session().name(), "session.name"));
  bool sets_labels = !request.has_update_mask();
  bool sets_ttl = sets_labels;
  for (const std::string& path : request.update_mask().paths()) {
    if (path != "labels" && path != "ttl") {
      return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                       absl::StrCat("update_mask has \"", path, "\"; labels and ttl are accepted"), "update_mask");
    }
    (path == "labels" ? sets_labels : sets_ttl) = true;
  }
  std::optional<Labels> labels;
  if (sets_labels) {
    WELLSPACE_ASSIGN_OR_RETURN(labels, LabelsFromProto(request.session().labels(), "session.labels"));
  }
  std::optional<absl::Duration> ttl;
  if (sets_ttl) {
    const google::protobuf::Duration* given = request.session().has_ttl() ? &request.session().ttl() : nullptr;
    WELLSPACE_ASSIGN_OR_RETURN(ttl, TtlFromProto(given, "session.ttl", environment.options));
  }
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t expected_revision, ExpectedRevisionOf(request));
  return session->Update(std::move(labels), ttl, expected_revision, [&](const v1::Session& updated) {
    *response.mutable_session() = updated;
    return identified.Answer(response);
  });
}

absl::Status Delete(const CallEnvironment& environment, const Caller& caller, const v1::DeleteSessionRequest& request,
                    const IdentifiedRequest& identified) {
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment, caller, request.name()));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t expected_revision, ExpectedRevisionOf(request));
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<Operation> under_way,
                             session->Close(expected_revision, identified.Answer(v1::DeleteSessionResponse())));
  environment.sessions.Remove(*session);
  if (under_way != nullptr) {
    WELLSPACE_RETURN_IF_ERROR(CancelOperation(environment, *session, *under_way));
  }
  // To free much memory takes long.
  environment.background.Post([session = std::move(session)] {});
  return absl::OkStatus();
}

absl::Status Remove(const CallEnvironment& environment, const Caller& caller, const v1::RemovePointsRequest& request,
                    const IdentifiedRequest& identified, v1::RemovePointsResponse& response) {
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment, caller, request.name()));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t expected_revision, ExpectedRevisionOf(request));
  const SessionUse use(session);
  const auto set_response = [&](const PointsLeft& left) {
    response.set_committed_points(left.points);
    response.set_revision(left.revision);
  };
  // The request, of which the call has a copy, and the numbers in ascending order.
  const auto count = static_cast<size_t>(request.points_size());
  WELLSPACE_ASSIGN_OR_RETURN(const MemoryReservation memory,
                             environment.memory.Reserve(2 * count * sizeof(uint64_t), "the points to be removed"));
  const std::span<const uint64_t> numbers(request.points().data(), count);
  const auto answer = [&](const PointsLeft& left) {
    set_response(left);
    return identified.Answer(response);
  };
  WELLSPACE_ASSIGN_OR_RETURN(const PointsLeft left, session->RemovePoints(numbers, expected_revision, answer));
  set_response(left);
  return absl::OkStatus();
}

absl::Status Get(const CallEnvironment& environment, const Caller& caller, const v1::GetSessionRequest& request,
                 v1::Session* found) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<Session> session, FindSession(environment, caller, request.name()));
  *found = session->Describe();
  return absl::OkStatus();
}

}  // namespace

grpc::ServerUnaryReactor* SessionService::CreateSession(grpc::CallbackServerContext* context,
                                                        const v1::CreateSessionRequest* request,
                                                        v1::CreateSessionResponse* response) {
  return UnaryCall::ServeOnce(
      environment_, context, request, response, "",
      [this](const Caller& caller, const v1::CreateSessionRequest& own, const IdentifiedRequest& identified,
             v1::CreateSessionResponse& answer) { return Create(environment_, caller, own, identified, answer); });
}

grpc::ServerUnaryReactor* SessionService::GetSession(grpc::CallbackServerContext* context,
                                                     const v1::GetSessionRequest* request,
                                                     v1::GetSessionResponse* response) {
  return UnaryCall::Serve(environment_, context, response,
                          [this, request](const Caller& caller, v1::GetSessionResponse& answer) {
                            return Get(environment_, caller, *request, answer.mutable_session());
                          });
}

grpc::ServerUnaryReactor* SessionService::ListSessions(grpc::CallbackServerContext* context,
                                                       const v1::ListSessionsRequest* request,
                                                       v1::ListSessionsResponse* response) {
  return UnaryCall::Serve(environment_, context, response,
                          [this, request](const Caller& caller, v1::ListSessionsResponse& answer) {
                            return List(environment_, caller, *request, answer);
                          });
}

grpc::ServerUnaryReactor* SessionService::UpdateSession(grpc::CallbackServerContext* context,
                                                        const v1::UpdateSessionRequest* request,
                                                        v1::UpdateSessionResponse* response) {
  return UnaryCall::ServeOnce(
      environment_, context, request, response, request->session().name(),
      [this](const Caller& caller, const v1::UpdateSessionRequest& own, const IdentifiedRequest& identified,
             v1::UpdateSessionResponse& answer) { return Update(environment_, caller, own, identified, answer); });
}

grpc::ServerUnaryReactor* SessionService::DeleteSession(grpc::CallbackServerContext* context,
                                                        const v1::DeleteSessionRequest* request,
                                                        v1::DeleteSessionResponse* response) {
  return UnaryCall::ServeOnce(
      environment_, context, request, response, request->name(),
      [this](const Caller& caller, const v1::DeleteSessionRequest& own, const IdentifiedRequest& identified,
             v1::DeleteSessionResponse& /*answer*/) { return Delete(environment_, caller, own, identified); });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* SessionService::UploadPoints(grpc::CallbackServerContext* context,
                                                                        grpc::ByteBuffer* response) {
  return UploadPointsCall::Begin(std::make_shared<UploadPointsCall>(environment_, context, response));
}

grpc::ServerUnaryReactor* SessionService::RemovePoints(grpc::CallbackServerContext* context,
                                                       const v1::RemovePointsRequest* request,
                                                       v1::RemovePointsResponse* response) {
  return UnaryCall::ServeOnce(
      environment_, context, request, response, request->name(),
      [this](const Caller& caller, const v1::RemovePointsRequest& own, const IdentifiedRequest& identified,
             v1::RemovePointsResponse& answer) { return Remove(environment_, caller, own, identified, answer); });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* SessionService::AddSegments(grpc::CallbackServerContext* context,
                                                                       grpc::ByteBuffer* response) {
  return AddSegmentsCall::Begin(std::make_shared<AddSegmentsCall>(environment_, context, response));
}

grpc::ServerReadReactor<grpc::ByteBuffer>* SessionService::AddTriangles(grpc::CallbackServerContext* context,
                                                                        grpc::ByteBuffer* response) {
  return AddTrianglesCall::Begin(std::make_shared<AddTrianglesCall>(environment_, context, response));
}

grpc::ServerReadReactor<grpc::ByteBuffer>* SessionService::SetSizes(grpc::CallbackServerContext* context,
                                                                    grpc::ByteBuffer* response) {
  return SetSizesCall::Begin(std::make_shared<SetSizesCall>(environment_, context, response));
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* SessionService::DownloadMesh(grpc::CallbackServerContext* context,
                                                                         const grpc::ByteBuffer* request) {
  return DownloadMeshCall::Begin(std::make_shared<DownloadMeshCall>(environment_, context, *request));
}

}  // namespace wellspace::server
