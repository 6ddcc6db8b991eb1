// Sessions and operations of the client library, and when it tries again.
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "client/error_details.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/client/grpc/fake_server.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

constexpr char kSession[] = "sessions/one";
constexpr char kOperation[] = "sessions/one/operations/two";

v1::Session MakeSession() {
  v1::Session session;
  session.set_name(kSession);
  session.set_state(v1::Session::STATE_READY);
  session.mutable_parameters()->set_dimension(2);
  session.mutable_parameters()->set_rho(1.5);
  session.mutable_parameters()->set_margin(0);
  session.mutable_parameters()->set_criterion(v1::CRITERION_WELL_SPACED);
  v1::SizeBox* box = session.mutable_parameters()->add_size_boxes();
  box->add_low(1);
  box->add_high(2);
  box->set_max_circumradius(0.5);
  (*session.mutable_labels())["job"] = "7";
  session.mutable_ttl()->set_seconds(90);
  session.mutable_ttl()->set_nanos(500'000'000);
  session.mutable_create_time()->set_seconds(1'000);
  session.mutable_expire_time()->set_seconds(2'000);
  session.set_revision(3);
  session.set_committed_points(4);
  session.set_vertex_count(5);
  session.set_simplex_count(6);
  session.set_last_operation(kOperation);
  session.set_segment_count(7);
  session.set_seed_count(8);
  session.set_faces(v1::FACE_RULE_UNION);
  session.set_snap_distance(0.5);
  session.set_crossings(v1::CROSSING_RULE_SPLIT);
  return session;
}

void ExpectIsTheSession(const Session& session) {
  EXPECT_EQ(session.name, kSession);
  EXPECT_EQ(session.state, SessionState::kReady);
  EXPECT_EQ(session.parameters.dimension, 2);
  EXPECT_EQ(session.parameters.rho, 1.5);
  EXPECT_EQ(session.parameters.margin, 0);
  EXPECT_EQ(session.parameters.criterion, Criterion::kWellSpaced);
  ASSERT_THAT(session.parameters.size_boxes, SizeIs(1));
  EXPECT_THAT(session.parameters.size_boxes[0].high, ElementsAre(2));
  EXPECT_EQ(session.labels, (Labels{{"job", "7"}}));
  EXPECT_EQ(session.ttl, absl::Milliseconds(90'500));
  EXPECT_EQ(session.create_time, absl::FromUnixSeconds(1'000));
  EXPECT_EQ(session.expire_time, absl::FromUnixSeconds(2'000));
  EXPECT_EQ(session.revision, 3u);
  EXPECT_EQ(session.committed_points, 4u);
  EXPECT_EQ(session.vertex_count, 5u);
  EXPECT_EQ(session.simplex_count, 6u);
  EXPECT_EQ(session.last_operation, kOperation);
  EXPECT_EQ(session.segment_count, 7u);
  EXPECT_EQ(session.seed_count, 8u);
  EXPECT_EQ(session.faces, FaceRule::kUnion);
  EXPECT_EQ(session.snap_distance, 0.5);
  EXPECT_EQ(session.crossings, CrossingRule::kSplit);
}

TEST(Sessions, CreateSendsAllAndARequestIdOfItsOwn) {
  FakeServer server;
  std::vector<v1::CreateSessionRequest> requests;
  server.sessions.create = [&requests](const v1::CreateSessionRequest& request, v1::CreateSessionResponse& response) {
    requests.push_back(request);
    *response.mutable_session() = MakeSession();
    return grpc::Status::OK;
  };
  SessionOptions options;
  options.parameters.dimension = 4;
  options.parameters.max_circumradius = 0.25;
  options.labels = {{"a", "b"}};
  options.ttl = absl::Milliseconds(1500);
  Client client = server.Client();
  const absl::StatusOr<Session> session = client.CreateSession(options);
  ASSERT_TRUE(session.ok()) << session.status();
  ExpectIsTheSession(*session);
  ASSERT_TRUE(client.CreateSession({}).ok());
  CallOptions call;
  call.request_id = "mine";
  ASSERT_TRUE(client.CreateSession({}, call).ok());
  ASSERT_THAT(requests, SizeIs(3));
  EXPECT_EQ(requests[0].parameters().dimension(), 4);
  EXPECT_EQ(requests[0].parameters().max_circumradius(), 0.25);
  EXPECT_EQ(requests[0].labels().at("a"), "b");
  EXPECT_EQ(requests[0].ttl().seconds(), 1);
  EXPECT_EQ(requests[0].ttl().nanos(), 500'000'000);
  EXPECT_FALSE(requests[1].has_ttl());
  EXPECT_THAT(requests[0].request_id(), SizeIs(32));
  EXPECT_NE(requests[0].request_id(), requests[1].request_id());
  EXPECT_EQ(requests[2].request_id(), "mine");
}

// What rho bounds there is not told as something else, nor asked for as something else.
TEST(Sessions, ACriterionOfANewerServerIsUnknown) {
  FakeServer server;
  server.sessions.get = [](const v1::GetSessionRequest&, v1::GetSessionResponse& response) {
    *response.mutable_session() = MakeSession();
    response.mutable_session()->mutable_parameters()->set_criterion(static_cast<v1::Criterion>(1000));
    return grpc::Status::OK;
  };
  std::vector<v1::CreateSessionRequest> requests;
  server.sessions.create = [&requests](const v1::CreateSessionRequest& request, v1::CreateSessionResponse& response) {
    requests.push_back(request);
    *response.mutable_session() = MakeSession();
    response.mutable_session()->mutable_parameters()->clear_criterion();
    return grpc::Status::OK;
  };
  Client client = server.Client();
  const absl::StatusOr<Session> session = client.GetSession(kSession);
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_EQ(session->parameters.criterion, Criterion::kUnknown);
  for (const Criterion criterion : {Criterion::kUnknown, Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
    SessionOptions options;
    options.parameters.criterion = criterion;
    const absl::StatusOr<Session> created = client.CreateSession(options);
    ASSERT_TRUE(created.ok()) << created.status();
    EXPECT_EQ(created->parameters.criterion, Criterion::kRadiusEdge) << "the default";
  }
  ASSERT_THAT(requests, SizeIs(3));
  EXPECT_FALSE(v1::Criterion_IsValid(requests[0].parameters().criterion())) << "a value that every server refuses";
  EXPECT_EQ(requests[1].parameters().criterion(), v1::CRITERION_RADIUS_EDGE);
  EXPECT_EQ(requests[2].parameters().criterion(), v1::CRITERION_WELL_SPACED);
}

TEST(Sessions, GetListUpdateDelete) {
  FakeServer server;
  server.sessions.get = [](const v1::GetSessionRequest& request, v1::GetSessionResponse& response) {
    EXPECT_EQ(request.name(), kSession);
    *response.mutable_session() = MakeSession();
    return grpc::Status::OK;
  };
  server.sessions.list = [](const v1::ListSessionsRequest& request, v1::ListSessionsResponse& response) {
    EXPECT_EQ(request.page_size(), 2);
    EXPECT_EQ(request.page_token(), "here");
    EXPECT_EQ(request.labels().at("job"), "7");
    *response.add_sessions() = MakeSession();
    response.set_next_page_token("there");
    return grpc::Status::OK;
  };
  std::vector<v1::UpdateSessionRequest> updates;
  server.sessions.update = [&updates](const v1::UpdateSessionRequest& request, v1::UpdateSessionResponse& response) {
    updates.push_back(request);
    *response.mutable_session() = MakeSession();
    return grpc::Status::OK;
  };
  server.sessions.remove = [](const v1::DeleteSessionRequest& request, v1::DeleteSessionResponse&) {
    EXPECT_EQ(request.name(), kSession);
    EXPECT_EQ(request.expected_revision(), 9u);
    return grpc::Status::OK;
  };
  Client client = server.Client();
  const absl::StatusOr<Session> session = client.GetSession(kSession);
  ASSERT_TRUE(session.ok()) << session.status();
  ExpectIsTheSession(*session);
  const absl::StatusOr<SessionPage> page = client.ListSessions({{"job", "7"}}, {.page_size = 2, .page_token = "here"});
  ASSERT_TRUE(page.ok()) << page.status();
  ASSERT_THAT(page->sessions, SizeIs(1));
  ExpectIsTheSession(page->sessions[0]);
  EXPECT_EQ(page->next_page_token, "there");
  ASSERT_TRUE(client.UpdateSession(kSession, {.labels = Labels{}, .ttl = std::nullopt}).ok());
  ASSERT_TRUE(client.UpdateSession(kSession, {.labels = std::nullopt, .ttl = absl::Seconds(5)}).ok());
  ASSERT_THAT(updates, SizeIs(2));
  EXPECT_THAT(updates[0].update_mask().paths(), ElementsAre("labels"));
  EXPECT_THAT(updates[1].update_mask().paths(), ElementsAre("ttl"));
  EXPECT_EQ(updates[1].session().ttl().seconds(), 5);
  CallOptions call;
  call.expected_revision = 9;
  EXPECT_TRUE(client.DeleteSession(kSession, call).ok());
}

TEST(Sessions, PointsAreRemovedByTheirNumbers) {
  FakeServer server;
  std::vector<v1::RemovePointsRequest> requests;
  server.sessions.remove_points = [&](const v1::RemovePointsRequest& request, v1::RemovePointsResponse& response) {
    requests.push_back(request);
    response.set_committed_points(8);
    response.set_revision(10);
    return grpc::Status::OK;
  };
  CallOptions call;
  call.expected_revision = 9;
  const std::vector<uint64_t> points = {7, 3};
  const absl::StatusOr<PointsLeft> left = server.Client().RemovePoints(kSession, points, call);
  ASSERT_TRUE(left.ok()) << left.status();
  EXPECT_EQ(left->point_count, 8u);
  EXPECT_EQ(left->revision, 10u);
  ASSERT_THAT(requests, SizeIs(1));
  EXPECT_EQ(requests[0].name(), kSession);
  EXPECT_THAT(requests[0].points(), ElementsAre(7, 3));
  EXPECT_EQ(requests[0].expected_revision(), 9u);
  EXPECT_FALSE(requests[0].request_id().empty()) << "repeated after a broken connection, it is to remove once";
}

v1::Operation MakeOperation(v1::Operation::State state) {
  v1::Operation operation;
  operation.set_name(kOperation);
  operation.set_state(state);
  operation.mutable_parameters()->set_dimension(2);
  operation.mutable_progress()->set_vertices(8);
  operation.mutable_create_time()->set_seconds(10);
  if (state == v1::Operation::STATE_FAILED) {
    const grpc::Status error =
        MakeError(grpc::StatusCode::RESOURCE_EXHAUSTED, "too many vertices", "ERROR_REASON_MESH_TOO_LARGE");
    operation.mutable_error()->ParseFromString(error.error_details());
    operation.mutable_error()->set_code(error.error_code());
    operation.mutable_error()->set_message(error.error_message());
    operation.mutable_start_time()->set_seconds(11);
    operation.mutable_end_time()->set_seconds(12);
  }
  return operation;
}

TEST(Operations, StartGetListCancel) {
  FakeServer server;
  std::vector<v1::StartRefinementRequest> starts;
  server.operations.start = [&starts](const v1::StartRefinementRequest& request,
                                      v1::StartRefinementResponse& response) {
    starts.push_back(request);
    *response.mutable_operation() = MakeOperation(v1::Operation::STATE_QUEUED);
    return grpc::Status::OK;
  };
  server.operations.get = [](const v1::GetOperationRequest& request, v1::GetOperationResponse& response) {
    EXPECT_EQ(request.name(), kOperation);
    *response.mutable_operation() = MakeOperation(v1::Operation::STATE_FAILED);
    return grpc::Status::OK;
  };
  server.operations.list = [](const v1::ListOperationsRequest& request, v1::ListOperationsResponse& response) {
    EXPECT_EQ(request.parent(), kSession);
    *response.add_operations() = MakeOperation(v1::Operation::STATE_RUNNING);
    response.set_next_page_token("more");
    return grpc::Status::OK;
  };
  server.operations.cancel = [](const v1::CancelOperationRequest& request, v1::CancelOperationResponse& response) {
    EXPECT_EQ(request.name(), kOperation);
    *response.mutable_operation() = MakeOperation(v1::Operation::STATE_CANCELLED);
    return grpc::Status::OK;
  };
  Client client = server.Client();
  MeshOptions parameters;
  parameters.rho = 3;
  ASSERT_TRUE(client.StartRefinement(kSession, {.parameters = parameters, .restart = true}).ok());
  const absl::StatusOr<Operation> started = client.StartRefinement(kSession);
  ASSERT_TRUE(started.ok()) << started.status();
  EXPECT_EQ(started->state, OperationState::kQueued);
  EXPECT_FALSE(started->start_time.has_value());
  EXPECT_TRUE(started->error.ok());
  ASSERT_THAT(starts, SizeIs(2));
  EXPECT_EQ(starts[0].parameters().rho(), 3);
  EXPECT_TRUE(starts[0].restart());
  EXPECT_FALSE(starts[1].has_parameters());
  EXPECT_FALSE(starts[1].restart());
  EXPECT_FALSE(starts[1].request_id().empty());
  const absl::StatusOr<Operation> failed = client.GetOperation(kOperation);
  ASSERT_TRUE(failed.ok()) << failed.status();
  EXPECT_EQ(failed->state, OperationState::kFailed);
  EXPECT_EQ(failed->error.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(failed->error), "ERROR_REASON_MESH_TOO_LARGE");
  EXPECT_EQ(failed->end_time, absl::FromUnixSeconds(12));
  const absl::StatusOr<OperationPage> page = client.ListOperations(kSession);
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_THAT(page->operations, SizeIs(1));
  EXPECT_EQ(page->next_page_token, "more");
  EXPECT_EQ(client.CancelOperation(kOperation)->state, OperationState::kCancelled);
}

TEST(Operations, AWatchIsJoinedAgainAfterTheLastEvent) {
  FakeServer server;
  std::vector<v1::WatchOperationRequest> requests;
  server.operations.watch = [&requests](grpc::ServerContext&, const v1::WatchOperationRequest& request, auto& writer) {
    requests.push_back(request);
    const uint64_t next = request.has_after_sequence() ? request.after_sequence() + 1 : 0;
    v1::WatchOperationResponse response;
    response.mutable_progress()->set_sequence(next);
    response.mutable_progress()->set_phase(v1::PHASE_REFINEMENT);
    writer.Write(response);
    if (next < 6) {
      return Broken();
    }
    *response.mutable_operation() = MakeOperation(v1::Operation::STATE_SUCCEEDED);
    writer.Write(response);
    return grpc::Status::OK;
  };
  std::vector<uint64_t> sequences;
  const absl::StatusOr<Operation> operation = server.Client().WatchOperation(
      kOperation, [&sequences](const Progress& progress) { sequences.push_back(progress.sequence); });
  ASSERT_TRUE(operation.ok()) << operation.status();
  EXPECT_EQ(operation->state, OperationState::kSucceeded);
  EXPECT_THAT(sequences, ElementsAre(0, 1, 2, 3, 4, 5, 6));
  EXPECT_FALSE(requests[0].has_after_sequence());
  EXPECT_EQ(requests[6].after_sequence(), 5u);
  ASSERT_TRUE(server.Client().WatchOperation(kOperation, nullptr, 6).ok());
  EXPECT_EQ(requests[7].after_sequence(), 6u);
}

TEST(Operations, AWatchWithoutAnEndIsDataLoss) {
  FakeServer server;
  server.operations.watch = [](grpc::ServerContext&, const auto&, auto&) { return grpc::Status::OK; };
  EXPECT_EQ(server.Client().WatchOperation(kOperation).status().code(), absl::StatusCode::kDataLoss);
}

// A server whose DeleteSession fails with `errors`, one after the other, then succeeds.
class Failing {
 public:
  Failing(FakeServer& server, std::vector<grpc::Status> errors) : errors_(std::move(errors)) {
    server.sessions.remove = [this](const v1::DeleteSessionRequest& request, v1::DeleteSessionResponse&) {
      request_ids.insert(request.request_id());
      return calls < errors_.size() ? errors_[calls++] : (++calls, grpc::Status::OK);
    };
  }

  size_t calls = 0;
  std::set<std::string> request_ids;

 private:
  const std::vector<grpc::Status> errors_;
};

TEST(Retries, RepeatWhatMaySucceedLaterUnderOneRequestId) {
  FakeServer server;
  Failing failing(server, {Broken(), MakeError(grpc::StatusCode::RESOURCE_EXHAUSTED, "queue full",
                                               "ERROR_REASON_QUEUE_FULL", /*retry_ms=*/2)});
  EXPECT_TRUE(server.Client().DeleteSession(kSession).ok());
  EXPECT_EQ(failing.calls, 3u);
  EXPECT_THAT(failing.request_ids, SizeIs(1));
}

TEST(Retries, DoNotRepeatWhatWillFailAgain) {
  FakeServer server;
  Failing failing(server, {MakeError(grpc::StatusCode::RESOURCE_EXHAUSTED, "quota", "ERROR_REASON_QUOTA_EXCEEDED")});
  const absl::Status status = server.Client().DeleteSession(kSession);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(failing.calls, 1u);
}

TEST(Retries, AServerThatNeverAnsweredGetsLessPatience) {
  FakeServer server;
  const std::vector<grpc::Status> broken(20, Broken());
  Failing failing(server, broken);
  server.sessions.get = [](const auto&, auto&) { return grpc::Status(grpc::StatusCode::NOT_FOUND, "none"); };
  Client client = server.Client();
  EXPECT_EQ(client.DeleteSession(kSession), absl::UnavailableError("Socket closed"));
  EXPECT_EQ(failing.calls, 2u);
  EXPECT_EQ(client.GetSession(kSession).status(), absl::NotFoundError("none"));
  EXPECT_EQ(client.DeleteSession(kSession), absl::UnavailableError("Socket closed"));
  EXPECT_EQ(failing.calls, 6u);
}

TEST(Retries, EndAtTheDeadlineAndByAStop) {
  FakeServer server;
  const std::vector<grpc::Status> later(
      20, MakeError(grpc::StatusCode::UNAVAILABLE, "stopping", "ERROR_REASON_SERVER_STOPPING", /*retry_ms=*/900));
  Failing failing(server, later);
  CallOptions call;
  call.timeout = absl::Milliseconds(500);
  EXPECT_EQ(server.Client().DeleteSession(kSession, call).message(), "stopping");
  EXPECT_EQ(failing.calls, 1u);  // another attempt would be too late

  std::stop_source stop;
  server.sessions.remove = [&stop](const auto&, auto&) {
    stop.request_stop();
    return MakeError(grpc::StatusCode::UNAVAILABLE, "stopping", "ERROR_REASON_SERVER_STOPPING", /*retry_ms=*/999);
  };
  call.timeout = absl::InfiniteDuration();
  call.stop = stop.get_token();
  EXPECT_EQ(server.Client().DeleteSession(kSession, call), absl::CancelledError("cancelled by the caller"));
}

}  // namespace
}  // namespace wellspace::client
