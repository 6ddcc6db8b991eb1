// admin operations, cancel, drain and usage: what they ask, and what they print of all pages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/client/cli/process.h"
#include "tests/client/cli/session_fixture.h"

namespace wellspace {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class AdminCommandsTest : public SessionCommandsTest {};

TEST_F(AdminCommandsTest, OperationsAreThoseOfAllPages) {
  server_.admin.list = [](const v1::ListAllOperationsRequest& request, v1::ListAllOperationsResponse& response) {
    EXPECT_EQ(request.tenant(), "acme");
    EXPECT_EQ(request.state(), v1::Operation::STATE_RUNNING);
    v1::OwnedOperation& one = *response.add_operations();
    *one.mutable_operation() = MakeOperation(v1::Operation::STATE_RUNNING);
    one.set_tenant("acme");
    one.set_replica(request.page_token().empty() ? "" : "mesh-2");
    one.set_address("mesh-2:7233");
    response.set_next_page_token(request.page_token().empty() ? "next" : "");
    return grpc::Status::OK;
  };
  const RunResult text = Run({"admin", "operations", "--tenant", "acme", "--state", "running"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.out.substr(0, 6), "TENANT");
  EXPECT_EQ(std::count(text.out.begin(), text.out.end(), '\n'), 3);
  EXPECT_THAT(text.out, HasSubstr("mesh-2"));
  EXPECT_THAT(text.out, HasSubstr("running"));
  const RunResult result = Run({"admin", "operations", "--tenant", "acme", "--state", "running", "--output", "json"});
  const json listed = json::parse(result.out);
  ASSERT_EQ(listed.size(), 2u);
  EXPECT_EQ(listed[1]["replica"], "mesh-2");
  EXPECT_EQ(listed[1]["address"], "mesh-2:7233");
  EXPECT_EQ(listed[1]["tenant"], "acme");
  EXPECT_EQ(listed[1]["name"], kOperation);
  EXPECT_EQ(Run({"admin", "operations", "--state", "asleep"}).exit_code, 2);
}

TEST_F(AdminCommandsTest, CancelSaysWhatBecomesOfIt) {
  v1::Operation::State state = v1::Operation::STATE_RUNNING;
  server_.admin.cancel = [&](const v1::CancelAnyOperationRequest& request, v1::CancelAnyOperationResponse& response) {
    EXPECT_EQ(request.name(), kOperation);
    *response.mutable_operation() = MakeOperation(state);
    return grpc::Status::OK;
  };
  EXPECT_EQ(Run({"admin", "cancel", kOperation}).out, std::string(kOperation) + " is being cancelled\n");
  state = v1::Operation::STATE_SUCCEEDED;
  EXPECT_EQ(Run({"admin", "cancel", kOperation}).out, std::string(kOperation) + " succeeded\n");
}

TEST_F(AdminCommandsTest, DrainSaysHowLongWorkHas) {
  server_.admin.drain = [](const v1::DrainServerRequest&, v1::DrainServerResponse& response) {
    response.mutable_grace()->set_seconds(90);
    return grpc::Status::OK;
  };
  EXPECT_EQ(Run({"admin", "drain"}).out, "the server stops; running work has 1m30s\n");
  EXPECT_EQ(json::parse(Run({"admin", "drain", "--output", "json"}).out)["grace_seconds"], 90);
}

TEST_F(AdminCommandsTest, UsageHasALineForEachTenant) {
  server_.admin.usage = [](const v1::GetUsageRequest& request, v1::GetUsageResponse& response) {
    EXPECT_EQ(request.first_day(), "2026-11-01");
    EXPECT_EQ(request.last_day(), "2026-11-30");
    v1::TenantUsage& usage = *response.add_usage();
    usage.set_tenant(request.page_token().empty() ? "acme" : "beta");
    usage.set_meshes(2);
    usage.set_vertices(1234567);
    usage.mutable_processor_time()->set_seconds(3);
    usage.mutable_processor_time()->set_nanos(500'000'000);
    usage.set_sessions(1);
    usage.set_stored_bytes(4096);
    response.set_next_page_token(request.page_token().empty() ? "next" : "");
    return grpc::Status::OK;
  };
  const RunResult text = Run({"admin", "usage", "--since", "2026-11-01", "--until", "2026-11-30"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(std::count(text.out.begin(), text.out.end(), '\n'), 3);
  EXPECT_THAT(text.out, HasSubstr("1,234,567"));
  EXPECT_THAT(text.out, HasSubstr("beta"));
  const json told =
      json::parse(Run({"admin", "usage", "--since", "2026-11-01", "--until", "2026-11-30", "--output", "json"}).out);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0], json({{"tenant", "acme"},
                           {"meshes", 2},
                           {"vertices", 1234567},
                           {"processor_seconds", 3.5},
                           {"sessions", 1},
                           {"stored_bytes", 4096}}));
}

TEST_F(AdminCommandsTest, ARefusalIsTheCommandsError) {
  server_.admin.drain = [](const v1::DrainServerRequest&, v1::DrainServerResponse&) {
    return client::MakeError(grpc::StatusCode::PERMISSION_DENIED, "not for you", "ERROR_REASON_ADMIN_ONLY");
  };
  const RunResult refused = Run({"admin", "drain"});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.err, HasSubstr("not for you"));
}

}  // namespace
}  // namespace wellspace
