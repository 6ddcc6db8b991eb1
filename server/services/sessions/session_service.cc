#include "server/services/sessions/session_service.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "server/calls/unary_call.h"
#include "server/services/page_token.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/services/sessions/download_mesh_call.h"
#include "server/services/sessions/upload_points_call.h"
#include "server/sessions/refinement.h"
#include "server/sessions/session_store.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

grpc::Status Create(const CallEnvironment& environment, const Caller& caller, const v1::CreateSessionRequest& request,
                    v1::Session* created) {
  NewSession settings{.tenant = caller.tenant, .parameters = {}, .labels = {}, .ttl = {}};
  if (grpc::Status status = ParametersFromProto(request.parameters(), environment.options, &settings.parameters);
      !status.ok()) {
    return status;
  }
  if (grpc::Status status = CheckParametersSize(settings.parameters); !status.ok()) {
    return status;
  }
  if (grpc::Status status = LabelsFromProto(request.labels(), "labels", &settings.labels); !status.ok()) {
    return status;
  }
  if (grpc::Status status =
          TtlFromProto(request.has_ttl() ? &request.ttl() : nullptr, "ttl", environment.options, &settings.ttl);
      !status.ok()) {
    return status;
  }
  std::shared_ptr<Session> session;
  if (grpc::Status status = environment.sessions.Create(std::move(settings), &session); !status.ok()) {
    return status;
  }
  *created = session->Describe();
  return grpc::Status::OK;
}

// What the page tokens of a list of sessions depend on.
std::string ListOf(const Caller& caller, const Labels& labels) {
  std::string list = absl::StrCat("sessions of ", caller.tenant);
  for (const auto& [key, value] : labels) {
    absl::StrAppend(&list, "|", key.size(), ":", key, value);
  }
  return list;
}

grpc::Status List(const CallEnvironment& environment, const Caller& caller, const v1::ListSessionsRequest& request,
                  v1::ListSessionsResponse& response) {
  size_t count = 0;
  if (grpc::Status status = PageSizeFromProto(request.page_size(), &count); !status.ok()) {
    return status;
  }
  Labels labels;
  if (grpc::Status status = LabelsFromProto(request.labels(), "labels", &labels); !status.ok()) {
    return status;
  }
  const std::string list = ListOf(caller, labels);
  uint64_t after = 0;
  if (grpc::Status status = PositionFromProto(request.page_token(), list, 0, &after); !status.ok()) {
    return status;
  }
  const std::vector<std::shared_ptr<Session>> sessions =
      environment.sessions.List(caller.tenant, absl::FromUnixNanos(static_cast<int64_t>(after)), count + 1, labels);
  const size_t listed = FillPage(sessions, count, response.mutable_sessions());
  if (listed < sessions.size()) {
    response.set_next_page_token(
        MakePageToken(list, static_cast<uint64_t>(absl::ToUnixNanos(sessions[listed - 1]->create_time()))));
  }
  return grpc::Status::OK;
}

grpc::Status Update(const CallEnvironment& environment, const Caller& caller, const v1::UpdateSessionRequest& request,
                    v1::Session* updated) {
  std::shared_ptr<Session> session;
  if (grpc::Status status = FindSession(environment, caller, request.session().name(), &session, "session.name");
      !status.ok()) {
    return status;
  }
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
    if (grpc::Status status = LabelsFromProto(request.session().labels(), "session.labels", &labels.emplace());
        !status.ok()) {
      return status;
    }
  }
  std::optional<absl::Duration> ttl;
  if (sets_ttl) {
    if (grpc::Status status = TtlFromProto(request.session().has_ttl() ? &request.session().ttl() : nullptr,
                                           "session.ttl", environment.options, &ttl.emplace());
        !status.ok()) {
      return status;
    }
  }
  if (grpc::Status status = session->Update(std::move(labels), ttl, request.expected_revision()); !status.ok()) {
    return status;
  }
  *updated = session->Describe();
  return grpc::Status::OK;
}

grpc::Status Delete(const CallEnvironment& environment, const Caller& caller, const v1::DeleteSessionRequest& request) {
  std::shared_ptr<Session> session;
  if (grpc::Status status = FindSession(environment, caller, request.name(), &session); !status.ok()) {
    return status;
  }
  std::shared_ptr<Operation> under_way;
  if (grpc::Status status = session->Close(request.expected_revision(), &under_way); !status.ok()) {
    return status;
  }
  environment.sessions.Remove(*session);
  if (under_way != nullptr) {
    CancelOperation(environment, *session, *under_way);
  }
  // To free much memory takes long.
  environment.background.Post([session = std::move(session)] {});
  return grpc::Status::OK;
}

}  // namespace

grpc::ServerUnaryReactor* SessionService::CreateSession(grpc::CallbackServerContext* context,
                                                        const v1::CreateSessionRequest* request,
                                                        v1::CreateSessionResponse* response) {
  return UnaryCall::ServeOnce(environment_, context, request, response,
                              [this, request](const Caller& caller, v1::CreateSessionResponse& answer) {
                                return Create(environment_, caller, *request, answer.mutable_session());
                              });
}

grpc::ServerUnaryReactor* SessionService::GetSession(grpc::CallbackServerContext* context,
                                                     const v1::GetSessionRequest* request,
                                                     v1::GetSessionResponse* response) {
  return UnaryCall::Serve(environment_, context, response,
                          [this, request](const Caller& caller, v1::GetSessionResponse& answer) {
                            std::shared_ptr<Session> session;
                            grpc::Status status = FindSession(environment_, caller, request->name(), &session);
                            if (status.ok()) {
                              *answer.mutable_session() = session->Describe();
                            }
                            return status;
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
  return UnaryCall::ServeOnce(environment_, context, request, response,
                              [this, request](const Caller& caller, v1::UpdateSessionResponse& answer) {
                                return Update(environment_, caller, *request, answer.mutable_session());
                              });
}

grpc::ServerUnaryReactor* SessionService::DeleteSession(grpc::CallbackServerContext* context,
                                                        const v1::DeleteSessionRequest* request,
                                                        v1::DeleteSessionResponse* response) {
  return UnaryCall::ServeOnce(environment_, context, request, response,
                              [this, request](const Caller& caller, v1::DeleteSessionResponse& /*answer*/) {
                                return Delete(environment_, caller, *request);
                              });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* SessionService::UploadPoints(grpc::CallbackServerContext* context,
                                                                        grpc::ByteBuffer* response) {
  return UploadPointsCall::Begin(std::make_shared<UploadPointsCall>(environment_, context, response));
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* SessionService::DownloadMesh(grpc::CallbackServerContext* context,
                                                                         const grpc::ByteBuffer* request) {
  return DownloadMeshCall::Begin(std::make_shared<DownloadMeshCall>(environment_, context, *request));
}

}  // namespace wellspace::server
