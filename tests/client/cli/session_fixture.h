// A fixture for tests of the commands about sessions: a server of the test's making, with one session on it.
#ifndef WELLSPACE_TESTS_CLIENT_CLI_SESSION_FIXTURE_H_
#define WELLSPACE_TESTS_CLIENT_CLI_SESSION_FIXTURE_H_

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/client/cli/process.h"
#include "tests/client/grpc/fake_server.h"
#include "tests/support/temporary_folder.h"

namespace wellspace {

inline constexpr char kSession[] = "sessions/one";
inline constexpr char kOperation[] = "sessions/one/operations/two";

inline v1::Session MakeSession() {
  v1::Session session;
  session.set_name(kSession);
  session.set_state(v1::Session::STATE_OPEN);
  session.mutable_parameters()->set_dimension(2);
  session.mutable_parameters()->set_rho(1.5);
  session.mutable_parameters()->set_threads(3);
  session.mutable_ttl()->set_seconds(90);
  (*session.mutable_labels())["job"] = "7";
  session.set_revision(2);
  session.set_committed_points(1234);
  session.set_last_operation(kOperation);
  return session;
}

inline v1::Operation MakeOperation(v1::Operation::State state) {
  v1::Operation operation;
  operation.set_name(kOperation);
  operation.set_state(state);
  operation.mutable_progress()->set_vertices(4321);
  operation.set_mesh_revision(3);
  return operation;
}

// Runs the program with `server` as its server.
inline RunResult RunAt(const client::FakeServer& server, const std::vector<std::string>& arguments,
                       const std::string& input) {
  return RunWellspace(
      arguments, {.input = input, .environment = {"WELLSPACE_SERVER=" + server.address()}, .error_descriptor = -1});
}

class SessionCommandsTest : public testing::Test {
 protected:
  SessionCommandsTest() {
    server_.sessions.get = [](const v1::GetSessionRequest& request, v1::GetSessionResponse& response) {
      *response.mutable_session() = MakeSession();
      return request.name() == kSession ? grpc::Status::OK
                                        : client::MakeError(grpc::StatusCode::NOT_FOUND, "no session " + request.name(),
                                                            "ERROR_REASON_SESSION_NOT_FOUND");
    };
  }

  RunResult Run(const std::vector<std::string>& arguments, const std::string& input = "") {
    return RunAt(server_, arguments, input);
  }

  // The operation ends as `end` when it is watched.
  void OperationsEndAs(const v1::Operation& end) {
    server_.operations.start = [this](const v1::StartRefinementRequest& request,
                                      v1::StartRefinementResponse& response) {
      started_ = request;
      *response.mutable_operation() = MakeOperation(v1::Operation::STATE_QUEUED);
      return grpc::Status::OK;
    };
    server_.operations.watch = [end](grpc::ServerContext&, const v1::WatchOperationRequest& request, auto& writer) {
      EXPECT_EQ(request.name(), kOperation);
      v1::WatchOperationResponse response;
      response.mutable_progress()->set_phase(v1::PHASE_REFINEMENT);
      response.mutable_progress()->set_fraction(0.5);
      writer.Write(response);
      *response.mutable_operation() = end;
      writer.Write(response);
      return grpc::Status::OK;
    };
  }

  TemporaryFolder folder_;
  client::FakeServer server_;
  v1::StartRefinementRequest started_;
};

}  // namespace wellspace

#endif  // WELLSPACE_TESTS_CLIENT_CLI_SESSION_FIXTURE_H_
