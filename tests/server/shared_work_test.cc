// Real servers that share a PostgreSQL and a folder: operations that wait at a busy one are done by idle ones.
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <limits>
#include <memory>
#include <pqxx/pqxx>
#include <random>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "client/mesh_sink.h"
#include "client/point_source.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/free_port.h"
#include "tests/server/http_get.h"
#include "tests/server/recorder.h"
#include "tests/server/replicas_fixture.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/postgres_server.h"
#include "tests/server/subprocess.h"
#include "tests/support/amount.h"

namespace wellspace::server {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// Faults among clients that go on; the long test has more.
const int kFaults = test::Amount("WELLSPACE_FAULTS", 6);
constexpr int kClients = 4;

// Until `condition` holds, or a minute is over.
bool Await(const std::function<bool()>& condition) {
  const absl::Time deadline = absl::Now() + absl::Minutes(1);
  while (!condition()) {
    if (absl::Now() > deadline) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

// A server with one worker, for small jobs and others.
class Replica {
 public:
  Replica(std::vector<std::string> options, const std::string& errors,
          std::string address = absl::StrCat("127.0.0.1:", FreePort()))
      : metrics_(absl::StrCat("127.0.0.1:", FreePort())), address_(std::move(address)) {
    options.insert(options.end(),
                   {"--small-workers", "0", "--grace", "1", "--listen", address_, "--metrics-listen", metrics_});
    daemon_ = std::make_unique<Daemon>(options, errors, std::vector<std::string>(), Daemon::Listen::kAsTold);
  }

  Daemon& operator*() { return *daemon_; }
  Daemon* operator->() { return daemon_.get(); }
  const std::string& address() const { return address_; }
  SessionCalls Calls() { return CallsOf(*daemon_); }
  // A counter of operations: "offered", "given" or "taken".
  double Count(const std::string& what) const { return Metric(absl::StrCat("wellspace_operations_", what, "_total")); }
  double Metric(const std::string& name) const { return MetricAt(metrics_, name); }
  bool Has(const std::string& session) {
    grpc::Status status;
    Calls().Get(session, &status);
    return status.ok();
  }
  v1::Operation::State StateOf(const std::string& operation) {
    grpc::Status status;
    const v1::Operation::State state = Calls().GetOperation(operation, &status).state();
    return status.ok() ? state : v1::Operation::STATE_UNSPECIFIED;
  }
  void Kill() {
    daemon_->process().Signal(SIGKILL);
    daemon_->process().Wait();
  }

 private:
  const std::string metrics_;
  const std::string address_;
  std::unique_ptr<Daemon> daemon_;
};

class SharedWorkTest : public ReplicasTest {
 protected:
  // `more`: options with their values, in the place of those of Options.
  std::unique_ptr<Replica> StartReplica(const std::string& name, const std::vector<std::string>& more = {},
                                        const std::string& address = absl::StrCat("127.0.0.1:", FreePort())) const {
    std::vector<std::string> options = Options(name);
    for (size_t i = 0; i + 1 < more.size(); i += 2) {
      const auto before = std::ranges::find(options, more[i]);
      if (before != options.end()) {
        options.erase(before, before + 2);
      }
    }
    options.insert(options.end(), more.begin(), more.end());
    return std::make_unique<Replica>(options, ErrorPath(name), address);
  }

  // A session with points at `replica`. No two have the same.
  std::string MakeSessionAt(Replica& replica, int dimension, size_t points) {
    SessionCalls calls = replica.Calls();
    std::string name = calls.Create(dimension).name();
    const size_t batch = 50'000;
    const std::vector<double> all = UniformPoints(points, dimension, ++seed_);
    for (size_t i = 0; i < points; i += batch) {
      const auto first = all.begin() + static_cast<ptrdiff_t>(i * dimension);
      const auto count = static_cast<ptrdiff_t>(std::min(batch, points - i) * dimension);
      calls.Upload(name, i, std::vector<double>(first, first + count));
    }
    return name;
  }

  // Has the worker of `replica` at work for longer than the test. Returns the operation.
  std::string MakeBusy(Replica& replica) {
    const std::string name = replica.Calls().Start(MakeSessionAt(replica, 3, 1'000'000)).name();
    EXPECT_TRUE(Await([&] { return replica.StateOf(name) == v1::Operation::STATE_RUNNING; }));
    return name;
  }

  static void ExpectSuccess(client::Client& client, const std::string& operation) {
    const absl::StatusOr<client::Operation> ended = client.WatchOperation(operation);
    ASSERT_TRUE(ended.ok()) << ended.status();
    EXPECT_EQ(ended->state, client::OperationState::kSucceeded) << operation;
  }

  // That the mesh of a session is the one that `idle`, a server with a free worker, makes of its points, which are
  // those of `seed`.
  static void ExpectMeshOf(client::Client& client, const std::string& session, size_t points, uint64_t seed,
                           Replica& idle) {
    client::MeshCollector mesh;
    const absl::Status downloaded = client.DownloadMesh(session, mesh);
    ASSERT_TRUE(downloaded.ok()) << downloaded;
    client::MeshOptions options;
    options.dimension = 2;
    options.domain_low = {0, 0};
    options.domain_high = {1, 1};
    const absl::StatusOr<client::Mesh> direct = idle->Client().MeshPoints(options, UniformPoints(points, 2, seed));
    ASSERT_TRUE(direct.ok()) << direct.status();
    EXPECT_EQ(mesh.mesh().points, direct->points) << session;
    EXPECT_EQ(mesh.mesh().simplices, direct->simplices) << session;
  }

  uint64_t seed_ = 0;
};

TEST_F(SharedWorkTest, IdleServersTakeWhatWaits) {
  const auto first = StartReplica("first");
  const auto second = StartReplica("second");
  const auto third = StartReplica("third");
  const std::string busy = MakeBusy(*first);
  constexpr size_t kSessions = 6;
  constexpr size_t kPoints = 2000;
  std::vector<std::string> sessions;
  std::vector<uint64_t> seeds;
  std::vector<std::string> operations;
  SessionCalls calls = first->Calls();
  for (size_t i = 0; i < kSessions; ++i) {
    sessions.push_back(MakeSessionAt(*first, 2, kPoints));
    seeds.push_back(seed_);
    v1::StartRefinementRequest start;
    start.set_name(sessions.back());
    start.set_request_id(absl::StrCat("start-", i));
    operations.push_back(calls.Start(start).name());
    EXPECT_EQ(calls.Start(start).name(), operations.back()) << "the same request";
  }
  // One who watches at the first server is told where the operation has gone.
  grpc::ClientContext context;
  v1::WatchOperationRequest watch;
  watch.set_name(operations[0]);
  const auto stream = calls.operations().WatchOperation(&context, watch);
  v1::WatchOperationResponse event;
  while (stream->Read(&event)) {
  }
  const auto details = DetailsOf(stream->Finish());
  EXPECT_EQ(details.reason, "SESSION_ELSEWHERE");
  EXPECT_THAT((std::set<std::string>{second->address(), third->address()}), Contains(details.address));

  client::Client client = (*first)->Client();
  for (size_t i = 0; i < kSessions; ++i) {
    ExpectSuccess(client, operations[i]);
    EXPECT_FALSE(first->Has(sessions[i])) << "it has given it away";
    // The same request once more, at any server, starts nothing.
    v1::StartRefinementRequest start;
    start.set_name(sessions[i]);
    start.set_request_id(absl::StrCat("start-", i));
    grpc::Status status;
    const v1::Operation again = third->Calls().Start(start, &status);
    EXPECT_TRUE(status.ok() ? again.name() == operations[i] : DetailsOf(status).reason == "SESSION_ELSEWHERE")
        << status.error_message();
    EXPECT_EQ(client.ListOperations(sessions[i])->operations.size(), 1u);
  }
  EXPECT_EQ(first->Count("offered"), kSessions);
  EXPECT_EQ(first->Count("given"), kSessions);
  EXPECT_EQ(second->Count("taken") + third->Count("taken"), kSessions);
  EXPECT_EQ(first->StateOf(busy), v1::Operation::STATE_RUNNING) << "what has begun stays";
  EXPECT_EQ(first->Calls().List({}).sessions_size(), 1);
  EXPECT_THAT(TextOfFile(ErrorPath("first")), HasSubstr("event=work_given"));
  EXPECT_THAT(TextOfFile(ErrorPath("second")) + TextOfFile(ErrorPath("third")), HasSubstr("event=work_taken"));
  for (size_t i = 0; i < kSessions; ++i) {
    ExpectMeshOf(client, sessions[i], kPoints, seeds[i], *third);
  }
  // The sessions are as any, where they are now.
  EXPECT_TRUE(client.AddVertices(sessions[0], std::vector<double>{0.501, 0.499}).ok());
  ExpectSuccess(client, client.StartRefinement(sessions[0])->name);
  calls.Cancel(busy);
}

// One that has taken work dies in the middle of it.
TEST_F(SharedWorkTest, ATakerThatIsKilledLosesNothing) {
  const auto first = StartReplica("first");
  auto second = StartReplica("second");
  const std::string busy = MakeBusy(*first);
  const std::string session = MakeSessionAt(*first, 2, 300'000);
  const uint64_t seed = seed_;
  const std::string operation = first->Calls().Start(session).name();
  ASSERT_TRUE(Await([&] { return second->StateOf(operation) == v1::Operation::STATE_RUNNING; }));
  second->Kill();
  first->Calls().Cancel(busy);
  client::Client client = (*first)->Client();
  ExpectSuccess(client, operation);
  EXPECT_TRUE(first->Has(session));
  EXPECT_EQ(first->Count("given"), 1);
  ExpectMeshOf(client, session, 300'000, seed, *first);
}

TEST_F(SharedWorkTest, AnOfferEndsWhenTheOwnerHasTime) {
  const auto first = StartReplica("first");
  const std::string busy = MakeBusy(*first);
  const std::string session = MakeSessionAt(*first, 2, 2000);
  const std::string operation = first->Calls().Start(session).name();
  ASSERT_TRUE(Await([&] { return first->Count("offered") == 1; }));
  EXPECT_EQ(first->Calls().Get(session).state(), v1::Session::STATE_REFINING) << "it is here as long as none takes it";
  EXPECT_EQ(first->Calls().List({}).sessions_size(), 2);
  first->Calls().Cancel(busy);
  client::Client client = (*first)->Client();
  ExpectSuccess(client, operation);
  const auto second = StartReplica("second");
  std::this_thread::sleep_for(std::chrono::seconds(3));  // it looks each second
  EXPECT_EQ(second->Count("taken"), 0);
  EXPECT_EQ(first->Count("given"), 0);
  ExpectMeshOf(client, session, 2000, seed_, *first);
}

// It does not begin before it is known that no other server has it.
TEST_F(SharedWorkTest, WhatIsOfferedWaitsForTheDatabase) {
  const auto first = StartReplica("first");
  // Without a session, so that it can be ended without the database.
  std::stop_source stop;
  std::jthread busy([&] {
    client::MeshOptions options;
    client::CallOptions call;
    call.stop = stop.get_token();
    const auto meshed = (*first)->Client().MeshPoints(options, UniformPoints(1'000'000, 3, 1), nullptr, call);
    EXPECT_TRUE(absl::IsCancelled(meshed.status())) << meshed.status();
  });
  ASSERT_TRUE(Await([&] { return first->Metric("wellspace_jobs_running") == 1; }));
  const std::string operation = first->Calls().Start(MakeSessionAt(*first, 2, 2000)).name();
  ASSERT_TRUE(Await([&] { return first->Count("offered") == 1; }));
  PostgresServer::OfThisProgram().Kill();
  stop.request_stop();
  EXPECT_TRUE(Await([&] { return first->Metric("wellspace_other_jobs_begun_total") >= 4; })) << "it is tried again";
  EXPECT_THAT(TextOfFile(ErrorPath("first")), Not(HasSubstr("event=refinement")));
  PostgresServer::OfThisProgram().Start();
  client::Client client = (*first)->Client();
  ExpectSuccess(client, operation);
  EXPECT_EQ(first->Count("given"), 0);
}

// Those that are first in line stay, and where the line has become short, an offer is withdrawn.
TEST_F(SharedWorkTest, AsManyAreKeptAsAreAskedFor) {
  const auto first = StartReplica("first", {"--keep-queued", "1"});
  const std::string busy = MakeBusy(*first);
  std::vector<std::string> operations;
  for (int i = 0; i < 2; ++i) {
    operations.push_back(first->Calls().Start(MakeSessionAt(*first, 2, 2000)).name());
  }
  ASSERT_TRUE(Await([&] { return first->Count("offered") == 1; }));
  first->Calls().Cancel(operations[0]);
  std::this_thread::sleep_for(std::chrono::seconds(3));  // it looks each second
  const auto second = StartReplica("second");
  std::this_thread::sleep_for(std::chrono::seconds(3));
  EXPECT_EQ(second->Count("taken"), 0);
  EXPECT_EQ(first->StateOf(operations[1]), v1::Operation::STATE_QUEUED);
  operations.push_back(first->Calls().Start(MakeSessionAt(*first, 2, 2000)).name());
  client::Client client = (*first)->Client();
  ExpectSuccess(client, operations[2]);
  EXPECT_EQ(second->Count("taken"), 1);
  EXPECT_EQ(first->StateOf(operations[1]), v1::Operation::STATE_QUEUED);
  first->Calls().Cancel(busy);
  ExpectSuccess(client, operations[1]);
}

// A server takes no work of a tenant that has as many jobs there as it may have.
TEST_F(SharedWorkTest, QuotasHoldWhereWorkIsTaken) {
  const auto first = StartReplica("first");
  const auto second = StartReplica("second", {"--workers", "2", "--max-jobs-per-tenant", "1"});
  const std::string busy = MakeBusy(*first);
  const std::string other = MakeBusy(*second);
  const std::string operation = first->Calls().Start(MakeSessionAt(*first, 2, 2000)).name();
  ASSERT_TRUE(Await([&] { return first->Count("offered") == 1; }));
  std::this_thread::sleep_for(std::chrono::seconds(3));  // it looks each second
  EXPECT_EQ(second->Count("taken"), 0);
  second->Calls().Cancel(other);
  client::Client client = (*first)->Client();
  ExpectSuccess(client, operation);
  EXPECT_EQ(second->Count("taken"), 1);
  first->Calls().Cancel(busy);
}

// Transactions of all connections to a database; its own among them.
int64_t Transactions(const std::string& address) {
  pqxx::connection connection(address);
  return pqxx::nontransaction(connection)
      .exec1("SELECT xact_commit + xact_rollback FROM pg_stat_database WHERE datname = current_database()")[0]
      .as<int64_t>();
}

// It looks twice a second, for owners that are no more and for work, and renews its lease, here three times in two
// seconds.
TEST_F(SharedWorkTest, AnIdleServerHardlyAsksTheDatabase) {
  const auto first = StartReplica("first");
  std::this_thread::sleep_for(std::chrono::seconds(2));  // PostgreSQL counts the start with a delay
  constexpr int kSeconds = 4;
  int64_t asked = std::numeric_limits<int64_t>::max();  // in the quietest of three times: PostgreSQL works, too
  for (int time = 0; time < 3; ++time) {
    const int64_t before = Transactions(store_);
    std::this_thread::sleep_for(std::chrono::seconds(kSeconds));
    asked = std::min(asked, Transactions(store_) - before);
  }
  EXPECT_GE(asked, kSeconds);
  EXPECT_LE(asked, (2 + 1.5 + 1) * kSeconds);
  RecordProperty("transactions", static_cast<int>(asked));
}

// One server is busy all the time, and its work goes to others, which die and are drained meanwhile: all that any
// server has acknowledged is there, each request was done once.
TEST_F(SharedWorkTest, NothingIsLostWhileWorkMoves) {
  const uint32_t seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::minstd_rand random(seed);
  const std::vector<std::string> names = {"first", "second", "third"};
  std::vector<std::unique_ptr<Replica>> replicas;
  std::vector<std::string> addresses;
  for (const std::string& name : names) {
    replicas.push_back(StartReplica(name));
    addresses.push_back(replicas.back()->address());
  }
  std::string busy = MakeBusy(*replicas[0]);
  double given = 0;
  const Recorded recorded = RecordAmongFaults(addresses, kClients, kFaults, [&](int i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2000 + random() % 2000));
    if (replicas[0]->StateOf(busy) != v1::Operation::STATE_RUNNING) {
      busy = MakeBusy(*replicas[0]);
    }
    const size_t which = 1 + random() % 2;
    replicas[which]->operator->()->process().Signal(i % 2 == 0 ? SIGKILL : SIGTERM);
    replicas[which]->operator->()->process().Wait();
    replicas[which] = StartReplica(names[which], {}, addresses[which]);
    if (i + 1 == kFaults) {
      given = replicas[0]->Count("given");
      replicas[0]->Calls().Cancel(busy);  // so that all work comes to its end
    }
  });
  EXPECT_GT(given, 0);
  RecordProperty("sessions", recorded.lives);
  RecordProperty("given", absl::StrCat(given));
}

}  // namespace
}  // namespace wellspace::server
