// Administration of real servers that share a PostgreSQL: the work of all, and usage that is counted once.
#include <signal.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/client.h"
#include "client/point_source.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/security/tokens.h"
#include "tests/server/daemon.h"
#include "tests/server/replicas_fixture.h"

namespace wellspace::server {
namespace {

using ::testing::SizeIs;

const std::string kAcme(40, 'a');
const std::string kOps(40, 'o');

class AdminReplicasTest : public ReplicasTest {
 protected:
  std::unique_ptr<Daemon> StartWithTokens(const std::string& name) const {
    const std::string tokens = absl::StrCat(errors_.path(), "/tokens");
    WriteFile(tokens, absl::StrCat(*MakeTokenLine("acme", kAcme), "\n", *MakeTokenLine("ops", kOps, true), "\n"));
    std::vector<std::string> options = Options(name);
    options.insert(options.end(), {"--token-file", tokens});
    return std::make_unique<Daemon>(options, ErrorPath(name));
  }

  // A session whose mesh is small.
  static std::string Refined(client::Client& client) {
    client::SessionOptions options;
    options.parameters.dimension = 2;
    const std::string session = client.CreateSession(options).value().name;
    const std::vector<double> points = UniformPoints(300, 2, 1);
    client::SpanSource source(2, points);
    EXPECT_TRUE(client.UploadPoints(session, source).ok());
    EXPECT_EQ(client.WatchOperation(client.StartRefinement(session).value().name)->state,
              client::OperationState::kSucceeded);
    return session;
  }

  // Begins work that takes seconds, and returns its name when a worker is at it.
  static std::string BeginLongWork(client::Client& client, const std::string& session) {
    client::RefinementOptions refinement;
    refinement.parameters = client.GetSession(session)->parameters;
    refinement.parameters->max_circumradius = 0.001;
    const std::string operation = client.StartRefinement(session, refinement).value().name;
    while (client.GetOperation(operation)->state == client::OperationState::kQueued) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_EQ(client.GetOperation(operation)->state, client::OperationState::kRunning);
    return operation;
  }

  // The operation when it has ended; servers may be on their way to it.
  static absl::StatusOr<client::Operation> AwaitEnd(client::Client& client, const std::string& operation) {
    const absl::Time deadline = absl::Now() + absl::Minutes(2);
    absl::StatusOr<client::Operation> ended = client.WatchOperation(operation);
    while (absl::IsUnavailable(ended.status()) && absl::Now() < deadline) {
      ended = client.WatchOperation(operation);
    }
    return ended;
  }

  // That of acme, which has some.
  static client::TenantUsage UsageOfAcme(client::Client& ops) { return ops.GetUsage({.tenant = "acme"})->usage.at(0); }
};

TEST_F(AdminReplicasTest, AnyServerTellsTheWorkOfAll) {
  const auto first = StartWithTokens("first");
  const auto second = StartWithTokens("second");
  client::Client acme = first->Client({.token = kAcme});
  client::Client ops = second->Client({.token = kOps});
  const std::string session = Refined(acme);
  const std::string running = BeginLongWork(acme, session);
  const client::OwnedOperationPage all = ops.ListAllOperations().value();
  ASSERT_THAT(all.operations, SizeIs(2));
  for (const client::OwnedOperation& one : all.operations) {
    EXPECT_EQ(one.tenant, "acme");
    EXPECT_EQ(one.replica, "first");
    EXPECT_EQ(one.address, first->address());
  }
  const client::OwnedOperationPage page =
      ops.ListAllOperations({.tenant = "acme", .state = client::OperationState::kRunning}).value();
  ASSERT_THAT(page.operations, SizeIs(1));
  EXPECT_EQ(page.operations[0].operation.name, running);
  EXPECT_THAT(ops.ListAllOperations({.tenant = "ops"})->operations, SizeIs(0));
  // The client goes where the error says that the session is.
  ASSERT_TRUE(ops.CancelAnyOperation(running).ok());
  EXPECT_EQ(acme.WatchOperation(running)->state, client::OperationState::kCancelled);
  const client::TenantUsage usage = UsageOfAcme(ops);
  EXPECT_EQ(usage.meshes, 1u) << "what was cancelled has made none";
  EXPECT_EQ(usage.stored_bytes, acme.GetSession(session)->stored_bytes);
}

TEST_F(AdminReplicasTest, WorkIsCountedOnceWhicheverServerDies) {
  auto first = StartWithTokens("first");
  const auto second = StartWithTokens("second");
  client::Client ops = second->Client({.token = kOps});
  std::string session;
  std::string operation;
  {
    client::Client acme = first->Client({.token = kAcme});
    session = Refined(acme);
    operation = BeginLongWork(acme, session);
  }
  const client::TenantUsage before = UsageOfAcme(ops);
  EXPECT_EQ(before.meshes, 1u);
  first->process().Signal(SIGKILL);
  first->process().Wait();
  client::Client acme = second->Client({.token = kAcme});
  const absl::StatusOr<client::Operation> ended = AwaitEnd(acme, operation);
  ASSERT_TRUE(ended.ok()) << ended.status();
  ASSERT_EQ(ended->state, client::OperationState::kSucceeded);
  const client::TenantUsage after = UsageOfAcme(ops);
  EXPECT_EQ(after.meshes, 2u);
  EXPECT_EQ(after.vertices, ended->progress.vertices) << "the second mesh has those of the first";
  EXPECT_GT(after.processor_time, before.processor_time);
  EXPECT_EQ(after.stored_bytes, acme.GetSession(session)->stored_bytes);
}

// Its work is handed over as after SIGTERM, and counted where it ends.
TEST_F(AdminReplicasTest, ADrainedServerExitsAndHandsItsWorkOver) {
  auto first = StartWithTokens("first");
  const auto second = StartWithTokens("second");
  client::Client acme = first->Client({.token = kAcme});
  const std::string session = Refined(acme);
  const std::string operation = BeginLongWork(acme, session);
  client::MeshOptions options;
  options.dimension = 2;
  ASSERT_TRUE(acme.MeshPoints(options, UniformPoints(50, 2, 2), nullptr).ok());
  client::Client stay = first->Client({.token = kOps, .follow = false});
  EXPECT_EQ(stay.DrainServer().value(), absl::Seconds(10));
  EXPECT_EQ(first->process().Wait(), 0) << "it exits";
  client::Client other = second->Client({.token = kAcme});
  const absl::StatusOr<client::Operation> ended = AwaitEnd(other, operation);
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state, client::OperationState::kSucceeded);
  client::Client ops = second->Client({.token = kOps});
  EXPECT_EQ(UsageOfAcme(ops).meshes, 3u) << "that of MeshPoints was written down at the end";
}

}  // namespace
}  // namespace wellspace::server
