// SessionService on the client's side, but for the streams.
#include <utility>

#include "client/grpc/convert.h"
#include "client/grpc/grpc_connection.h"
#include "core/base/status_macros.h"

namespace wellspace::client {

absl::StatusOr<Session> GrpcConnection::CreateSession(const SessionOptions& options, const CallOptions& call) {
  v1::CreateSessionRequest request;
  SetParameters(options.parameters, request.mutable_parameters());
  request.mutable_labels()->insert(options.labels.begin(), options.labels.end());
  if (options.ttl.has_value()) {
    SetDuration(*options.ttl, request.mutable_ttl());
  }
  request.set_request_id(RequestIdOf(call));
  v1::CreateSessionResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      Call(*servers_.first().sessions, &v1::SessionService::Stub::CreateSession, request, call, &response));
  return SessionFromProto(response.session());
}

absl::StatusOr<v1::Session> FetchSession(const std::string& session, const Server& server, const Attempt& attempt) {
  v1::GetSessionRequest request;
  request.set_name(session);
  v1::GetSessionResponse response;
  CallContext context(attempt);
  WELLSPACE_RETURN_IF_ERROR(FromGrpcStatus(server.sessions->GetSession(context.get(), request, &response)));
  return response.session();
}

absl::StatusOr<Session> GrpcConnection::GetSession(const std::string& session, const CallOptions& call) {
  absl::StatusOr<v1::Session> found;
  const absl::Status status = RunOn(session, call, [&](const Server& server, Attempt& attempt) {
    found = FetchSession(session, server, attempt);
    return found.status();
  });
  if (!status.ok()) {
    return status;
  }
  return SessionFromProto(*found);
}

absl::StatusOr<SessionPage> GrpcConnection::ListSessions(const Labels& labels, const PageOptions& page,
                                                         const CallOptions& call) {
  v1::ListSessionsRequest request;
  SetPage(page, request);
  request.mutable_labels()->insert(labels.begin(), labels.end());
  v1::ListSessionsResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      Call(*servers_.first().sessions, &v1::SessionService::Stub::ListSessions, request, call, &response));
  SessionPage result;
  for (const v1::Session& session : response.sessions()) {
    WELLSPACE_ASSIGN_OR_RETURN(Session one, SessionFromProto(session));
    result.sessions.push_back(std::move(one));
  }
  WELLSPACE_RETURN_IF_ERROR(CheckNextPage(page.page_token, response.next_page_token()));
  result.next_page_token = response.next_page_token();
  return result;
}

absl::StatusOr<Session> GrpcConnection::UpdateSession(const std::string& session, const SessionUpdate& change,
                                                      const CallOptions& call) {
  v1::UpdateSessionRequest request;
  request.mutable_session()->set_name(session);
  request.mutable_update_mask();
  if (change.labels.has_value()) {
    request.mutable_session()->mutable_labels()->insert(change.labels->begin(), change.labels->end());
    request.mutable_update_mask()->add_paths("labels");
  }
  if (change.ttl.has_value()) {
    SetDuration(*change.ttl, request.mutable_session()->mutable_ttl());
    request.mutable_update_mask()->add_paths("ttl");
  }
  request.set_request_id(RequestIdOf(call));
  SetExpectedRevision(call.expected_revision, request);
  v1::UpdateSessionResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(session, &Server::sessions, &v1::SessionService::Stub::UpdateSession, request, call, &response));
  return SessionFromProto(response.session());
}

absl::StatusOr<PointsLeft> GrpcConnection::RemovePoints(const std::string& session, std::span<const uint64_t> points,
                                                        const CallOptions& call) {
  v1::RemovePointsRequest request;
  request.set_name(session);
  request.mutable_points()->Assign(points.begin(), points.end());
  request.set_request_id(RequestIdOf(call));
  SetExpectedRevision(call.expected_revision, request);
  v1::RemovePointsResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(session, &Server::sessions, &v1::SessionService::Stub::RemovePoints, request, call, &response));
  return PointsLeft{.point_count = response.committed_points(), .revision = response.revision()};
}

absl::Status GrpcConnection::DeleteSession(const std::string& session, const CallOptions& call) {
  v1::DeleteSessionRequest request;
  request.set_name(session);
  request.set_request_id(RequestIdOf(call));
  SetExpectedRevision(call.expected_revision, request);
  v1::DeleteSessionResponse response;
  return CallOn(session, &Server::sessions, &v1::SessionService::Stub::DeleteSession, request, call, &response);
}

}  // namespace wellspace::client
