// refine, watch and cancel.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <future>
#include <limits>
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
  // Options that are not given stay as the session has them.
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

// The signal comes when the watch stands. A cancelled refinement is watched to its end: the session is then free.
TEST_F(OperationCommandsTest, CtrlCCancelsTheRefinementButNotAWatchedOne) {
  OperationsEndAs({});
  std::promise<void> watched;
  std::atomic<int> cancelled = 0;
  std::atomic<int> ended = 0;
  server_.operations.watch = [&](grpc::ServerContext& context, const auto&, auto& writer) {
    if (cancelled > 0) {
      v1::WatchOperationResponse response;
      *response.mutable_operation() = MakeOperation(v1::Operation::STATE_CANCELLED);
      writer.Write(response);
      ++ended;
      return grpc::Status::OK;
    }
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
    ended = 0;
    Process process({command, "one", "--server", server_.address()});
    watched.get_future().wait();
    ASSERT_EQ(kill(process.id(), SIGINT), 0);
    const RunResult result = process.Wait();
    EXPECT_EQ(result.exit_code, 130) << result.err;
    EXPECT_EQ(cancelled, command == std::string("refine") ? 1 : 0);
    EXPECT_EQ(ended, cancelled) << "the session may be busy still";
  }
}

// Standard error is a terminal, on which the bar is drawn.
TEST_F(OperationCommandsTest, AnyFractionIsDrawn) {
  OperationsEndAs({});
  server_.operations.watch = [](grpc::ServerContext&, const auto&, auto& writer) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double fraction : {std::nan(""), -kInfinity, kInfinity, 1e300, -1.0}) {
      v1::WatchOperationResponse response;
      response.mutable_progress()->set_fraction(fraction);
      response.mutable_progress()->set_vertices(~uint64_t{0});
      writer.Write(response);
    }
    v1::WatchOperationResponse end;
    *end.mutable_operation() = MakeOperation(v1::Operation::STATE_SUCCEEDED);
    writer.Write(end);
    return grpc::Status::OK;
  };
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_TRUE(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
  const int error = open(ptsname(terminal), O_RDWR | O_NOCTTY);
  ASSERT_GE(error, 0);
  const RunResult result =
      RunWellspace({"refine", "one"},
                   {.input = "", .environment = {"WELLSPACE_SERVER=" + server_.address()}, .error_descriptor = error});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, ::testing::HasSubstr("succeeded"));
  std::string drawn(4096, '\0');
  drawn.resize(std::max<ssize_t>(0, read(terminal, drawn.data(), drawn.size())));
  EXPECT_THAT(drawn, ::testing::HasSubstr("[----------------]   0%"));
  close(error);
  close(terminal);
}

TEST_F(OperationCommandsTest, NamesAndMessagesOfAServerDoNotReachTheTerminalAsCommands) {
  v1::Operation failed = MakeOperation(v1::Operation::STATE_FAILED);
  failed.mutable_error()->set_code(grpc::StatusCode::RESOURCE_EXHAUSTED);
  failed.mutable_error()->set_message("too \x1b[2Jmany");
  OperationsEndAs(failed);
  EXPECT_EQ(Run({"refine", "one"}).err, "wellspace: too \\x1b[2Jmany [RESOURCE_EXHAUSTED]\n");
  server_.sessions.get = [](const auto&, auto&) {
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "no \xff\x1b[2Jsession");
  };
  EXPECT_EQ(Run({"session", "show", "one"}).err, "wellspace: no \\xff\\x1b[2Jsession [NOT_FOUND]\n");
  const json error = json::parse(Run({"session", "show", "one", "--output", "json"}).err);
  EXPECT_EQ(error["error"]["message"], "no \\xff\\x1b[2Jsession");
  server_.sessions.get = [](const auto&, v1::GetSessionResponse& response) {
    *response.mutable_session() = MakeSession();
    response.mutable_session()->set_last_operation("\x1b[2J");
    (*response.mutable_session()->mutable_labels())["a\x1b]0;b\x07"] = "\xc2\x9b\x7f";
    return grpc::Status::OK;
  };
  for (const char* format : {"text", "json"}) {
    const RunResult shown = Run({"session", "show", "one", "--output", format});
    EXPECT_EQ(shown.exit_code, 0) << shown.err;
    for (const char* control : {"\x1b", "\x07", "\x7f", "\xc2\x9b"}) {
      EXPECT_EQ(shown.out.find(control), std::string::npos) << format;
    }
  }
  EXPECT_EQ(json::parse(Run({"session", "show", "one", "--output", "json"}).out)["labels"]["a\x1b]0;b\x07"],
            "\xc2\x9b\x7f")
      << "in JSON it is what it was";
}

}  // namespace
}  // namespace wellspace
