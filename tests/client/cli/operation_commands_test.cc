// refine, watch and cancel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <future>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/client/cli/process.h"
#include "tests/client/cli/session_fixture.h"

namespace wellspace {
namespace {

using nlohmann::json;
using ::testing::IsEmpty;

class OperationCommandsTest : public SessionCommandsTest {};

TEST_F(OperationCommandsTest, RefineWaitsForTheEnd) {
  OperationsEndAs(MakeOperation(v1::Operation::STATE_SUCCEEDED));
  const RunResult text = Run({"refine", "one"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.out, "sessions/one/operations/two succeeded: 4,321 vertices, revision 3\n");
  EXPECT_FALSE(started_.has_parameters());
  const RunResult result = Run({"refine", "one", "--output", "json", "--rho", "3", "--expected-revision", "8"});
  EXPECT_EQ(json::parse(result.out)["state"], "succeeded");
  // What is not given stays as the session has it.
  EXPECT_EQ(started_.parameters().dimension(), 2);
  EXPECT_EQ(started_.parameters().rho(), 3);
  EXPECT_EQ(started_.parameters().threads(), 3);
  EXPECT_EQ(started_.expected_revision(), 8u);
  const RunResult detached = Run({"refine", "one", "--detach"});
  EXPECT_EQ(detached.out, std::string(kOperation) + "\n");
}

// The other parameters stay those of the session.
TEST_F(OperationCommandsTest, RefineKeepsVerticesIfThatIsAsked) {
  OperationsEndAs(MakeOperation(v1::Operation::STATE_SUCCEEDED));
  EXPECT_EQ(Run({"refine", "one", "--keep-vertices", "--quiet"}).exit_code, 0);
  EXPECT_TRUE(started_.parameters().keep_vertices());
  EXPECT_EQ(started_.parameters().rho(), 1.5);
  EXPECT_EQ(Run({"refine", "one", "--rho", "2", "--quiet"}).exit_code, 0);
  EXPECT_FALSE(started_.parameters().keep_vertices());
}

TEST_F(OperationCommandsTest, AFailedOperationIsTheCommandsError) {
  v1::Operation failed = MakeOperation(v1::Operation::STATE_FAILED);
  failed.mutable_error()->set_code(grpc::StatusCode::RESOURCE_EXHAUSTED);
  failed.mutable_error()->set_message("too many vertices");
  OperationsEndAs(failed);
  for (const char* command : {"refine", "watch"}) {
    const RunResult result = Run({command, "one"});
    EXPECT_EQ(result.exit_code, 4);
    EXPECT_EQ(result.err, "wellspace: too many vertices [RESOURCE_EXHAUSTED]\n");
    EXPECT_THAT(result.out, IsEmpty());
  }
}

TEST_F(OperationCommandsTest, WatchPrintsEventsAsLinesOfJson) {
  OperationsEndAs(MakeOperation(v1::Operation::STATE_SUCCEEDED));
  const RunResult result = Run({"watch", kOperation, "--output", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const size_t end = result.out.find('\n');
  EXPECT_EQ(json::parse(result.out.substr(0, end))["phase"], "refinement");
  EXPECT_EQ(json::parse(result.out.substr(end))["mesh_revision"], 3);
}

TEST_F(OperationCommandsTest, CancelWaitsForTheEnd) {
  OperationsEndAs(MakeOperation(v1::Operation::STATE_CANCELLED));
  server_.operations.cancel = [](const v1::CancelOperationRequest& request, v1::CancelOperationResponse& response) {
    EXPECT_EQ(request.name(), kOperation);
    *response.mutable_operation() = MakeOperation(v1::Operation::STATE_RUNNING);
    return grpc::Status::OK;
  };
  for (const char* name : {"one", kOperation}) {
    const RunResult result = Run({"cancel", name});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, "sessions/one/operations/two cancelled\n");
  }
}

// The signal comes when the watch stands.
TEST_F(OperationCommandsTest, CtrlCCancelsTheRefinementButNotAWatchedOne) {
  OperationsEndAs({});
  std::promise<void> watched;
  int cancelled = 0;
  server_.operations.watch = [&watched](grpc::ServerContext& context, const auto&, auto& writer) {
    writer.Write({});
    watched.set_value();
    while (!context.IsCancelled()) {
      writer.Write({});
    }
    return grpc::Status::CANCELLED;
  };
  server_.operations.cancel = [&cancelled](const v1::CancelOperationRequest& request, auto&) {
    EXPECT_EQ(request.name(), kOperation);
    ++cancelled;
    return grpc::Status::OK;
  };
  for (const char* command : {"refine", "watch"}) {
    watched = {};
    cancelled = 0;
    Process process({command, "one", "--server", server_.address()});
    watched.get_future().wait();
    ASSERT_EQ(kill(process.id(), SIGINT), 0);
    const RunResult result = process.Wait();
    EXPECT_EQ(result.exit_code, 130) << result.err;
    EXPECT_EQ(cancelled, command == std::string("refine") ? 1 : 0);
  }
}

}  // namespace
}  // namespace wellspace
