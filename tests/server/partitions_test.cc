// Servers that share their sessions, PostgreSQL and HAProxy, each on a machine of its own: ways between them are cut, a
// server's clock jumps, one is older than the others.
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "client/error_details.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/merged_history.h"
#include "tests/server/mortal_replicas.h"
#include "tests/server/network_lab.h"
#include "tests/server/recorder.h"
#include "tests/server/replica_proxy.h"
#include "tests/server/replicas_fixture.h"
#include "tests/support/amount.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

constexpr size_t kServers = ReplicaProxy::kServers;
constexpr int kClients = 3;
// Faults among clients that go on, as a rule each kind once; the long test has more.
const int kFaults = test::Amount("WELLSPACE_FAULTS", 14);
// Behind the end of a lease others have its sessions.
const absl::Duration kBeyond = kLease + absl::Seconds(1);
// With a call whose answer does not come, as its connection is cut.
constexpr absl::Duration kPatience = absl::Seconds(5);
constexpr int kHour = 3600;

// Debian's, which shows programs another wall clock; empty: there is none.
std::string FakeTime() {
  for (const char* const machine : {"x86_64", "aarch64"}) {
    std::string path = absl::StrCat("/usr/lib/", machine, "-linux-gnu/faketime/libfaketimeMT.so.1");
    if (std::filesystem::exists(path)) {
      return path;
    }
  }
  return "";
}

void Pause(absl::Duration duration) { std::this_thread::sleep_for(absl::ToChronoMilliseconds(duration)); }

class PartitionsTest : public ReplicasTest {
 protected:
  void SetUp() override {
    for (const std::string& why : {PostgresServer::WhyNot(), ReplicaProxy::WhyNot(), NetworkLab::WhyNot()}) {
      if (!why.empty()) {
        GTEST_SKIP() << why;
      }
    }
    lab_ = std::make_unique<NetworkLab>();
    database_machine_ = lab_->AddMachine("db");
    database_ = std::make_unique<PostgresServer>(database_machine_.address, database_machine_.before);
    store_ = database_->NewDatabase();
    std::vector<MortalReplicas::Place> places;
    std::vector<ReplicaProxy::Server> proxied;
    for (size_t i = 0; i < kServers; ++i) {
      const std::string name = absl::StrCat("mesh", i + 1);
      machines_.push_back(lab_->AddMachine(name));
      proxied.push_back({.address = machines_[i].address + ":7233", .metrics = machines_[i].address + ":9464"});
      std::vector<std::string> options = Options(name);
      options.insert(options.end(), {"--metrics-listen", proxied[i].metrics, "--insecure-remote"});
      SetClock(i, 0);
      std::vector<std::string> before = machines_[i].before;
      if (!FakeTime().empty()) {
        before.insert(before.end(), {"/usr/bin/env", "LD_PRELOAD=" + FakeTime(), "FAKETIME_NO_CACHE=1",
                                     "DONT_FAKE_MONOTONIC=1", "FAKETIME_TIMESTAMP_FILE=" + ClockPath(i)});
      }
      places.push_back(
          {.options = options, .address = proxied[i].address, .error_path = ErrorPath(name), .before = before});
    }
    servers_ = std::make_unique<MortalReplicas>(std::move(places), kLease, *database_);
    ASSERT_FALSE(HasFailure()) << TextOfFile(ErrorPath("mesh1"));
    proxy_machine_ = lab_->AddMachine("proxy");
    proxy_ = std::make_unique<ReplicaProxy>(proxy_machine_.address + ":7233", proxied, proxy_machine_.before);
  }

  std::string ClockPath(size_t i) const { return absl::StrCat(clocks_.path(), "/", i); }
  // The wall clock of a server alone jumps to so many seconds behind or before the others'.
  void SetClock(size_t i, int seconds) const {
    const std::string written = ClockPath(i) + ".new";
    std::ofstream(written) << (seconds < 0 ? "" : "+") << seconds << "\n";
    std::filesystem::rename(written, ClockPath(i));
  }

  enum class Direction { kBoth, kThere, kBack };

  void Cut(size_t i, const NetworkLab::Machine& other, Direction direction) {
    if (direction != Direction::kBack) {
      lab_->Cut(machines_[i], other);
    }
    if (direction != Direction::kThere) {
      lab_->Cut(other, machines_[i]);
    }
  }

  // The way to the database or the proxy is cut for a moment, and beyond the lease, by turns.
  Fault CutOf(const std::string& kind, const NetworkLab::Machine& other, Direction direction) {
    const bool is_long_first = &other == &database_machine_ && direction != Direction::kBoth;
    return {kind, [this, &other, direction, count = is_long_first ? 0 : 1](size_t i) mutable {
              Cut(i, other, direction);
              Pause(count++ % 2 == 0 ? kBeyond : absl::Milliseconds(700));
              lab_->HealAll();
            }};
  }

  // A server is started again while the tables are those of a newer program, beside others that run.
  void StartOlder(size_t i) {
    const std::string version = "UPDATE wellspace.store SET version = version ";
    database_->Run(version + "+ 1", database_->last_database());
    servers_->End(i, SIGKILL);
    std::vector<std::string> options = Options(absl::StrCat("mesh", i + 1));
    options.insert(options.end(), {"--listen", "127.0.0.1:0"});
    Subprocess older("wellspaced", options, ErrorPath("older"));
    EXPECT_EQ(older.Wait(), 1);
    EXPECT_THAT(TextOfFile(ErrorPath("older")), HasSubstr("this program knows versions up to"));
    database_->Run(version + "- 1", database_->last_database());
    servers_->Start(i);
  }

  std::vector<Fault> AllFaults() {
    std::vector<Fault> faults = servers_->Faults();
    faults.push_back({"proxy restarted", [this](size_t) { proxy_->Restart(); }});
    faults.push_back(CutOf("database cut off", database_machine_, Direction::kBoth));
    faults.push_back(CutOf("to database cut", database_machine_, Direction::kThere));
    faults.push_back(CutOf("from database cut", database_machine_, Direction::kBack));
    faults.push_back(CutOf("proxy cut off", proxy_machine_, Direction::kBoth));
    faults.push_back(CutOf("to proxy cut", proxy_machine_, Direction::kThere));
    faults.push_back(CutOf("from proxy cut", proxy_machine_, Direction::kBack));
    faults.push_back({"newer tables", [this](size_t i) { StartOlder(i); }});
    if (FakeTime().empty()) {
      std::cout << "no clock jumps: libfaketime is not installed (deploy/install-deps.sh test)\n";
    } else {
      faults.push_back({"clock an hour on", [this](size_t i) { SetClock(i, kHour); }});
      faults.push_back({"clock an hour back", [this](size_t i) { SetClock(i, -kHour); }});
    }
    for (Fault& fault : faults) {
      fault.strike = [this, strike = fault.strike](size_t i) {
        ended_ += servers_->StartEnded();
        strike(i);
      };
    }
    return faults;
  }

  const TestFolder clocks_;
  std::unique_ptr<NetworkLab> lab_;
  NetworkLab::Machine database_machine_;
  NetworkLab::Machine proxy_machine_;
  std::vector<NetworkLab::Machine> machines_;
  std::unique_ptr<PostgresServer> database_;
  std::unique_ptr<MortalReplicas> servers_;
  std::unique_ptr<ReplicaProxy> proxy_;
  int ended_ = 0;  // servers, by themselves
};

// A server that is cut off from the database, be it in one direction, says nothing of its sessions once others may have
// them, whatever its clock.
TEST_F(PartitionsTest, WhoIsCutOffSaysNothingBehindItsLease) {
  for (const Direction direction : {Direction::kThere, Direction::kBack}) {
    const std::string name = MakeSession((*servers_)[0]);
    const std::string mesh = CallsOf((*servers_)[0]).MeshBytes(name);
    Cut(0, database_machine_, direction);
    SetClock(0, direction == Direction::kBack ? kHour : -kHour);
    Pause(kBeyond);
    SessionCalls old = CallsOf((*servers_)[0]);
    grpc::Status status;
    old.Get(name, &status);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
    SessionCalls others = CallsOf((*servers_)[1]);
    others.Get(name, &status);
    size_t owner = 1;
    if (!status.ok()) {
      EXPECT_EQ(DetailsOf(status).address, (*servers_)[2].address()) << status.error_message();
      owner = 2;
    }
    EXPECT_EQ(CallsOf((*servers_)[owner]).MeshBytes(name), mesh);
    lab_->HealAll();
    EXPECT_EQ((*servers_)[0].process().Wait(), 1) << "it has nothing any more, and is to be started again";
    SetClock(0, 0);
    servers_->Start(0);
    CallsOf((*servers_)[owner]).Delete(name);
  }
}

// Behind the proxy a session is found where it has gone, while the server that had it is still cut off.
TEST_F(PartitionsTest, TheProxyFindsWhatACutOffServerHasLost) {
  client::ConnectOptions options;
  options.follow = false;
  client::Client client = client::Connect(proxy_->address(), options).value();
  client::SessionOptions created;
  created.parameters.dimension = 2;
  const std::string name = client.CreateSession(created).value().name;
  size_t owner = 0;
  for (grpc::Status status; owner < kServers; ++owner) {
    CallsOf((*servers_)[owner]).Get(name, &status);
    if (status.ok()) {
      break;
    }
  }
  ASSERT_LT(owner, kServers);
  Cut(owner, database_machine_, Direction::kBoth);
  Pause(kLease);
  client::CallOptions call;
  call.timeout = absl::Seconds(15);
  const absl::StatusOr<client::Session> found = client.GetSession(name, call);
  EXPECT_TRUE(found.ok()) << found.status();
  lab_->HealAll();
}

// An older server does not touch tables of a newer one, and those that run go on.
TEST_F(PartitionsTest, WhoIsOlderThanTheTablesDoesNotStart) {
  const std::string name = MakeSession((*servers_)[0]);
  const std::string mesh = CallsOf((*servers_)[0]).MeshBytes(name);
  StartOlder(1);
  EXPECT_EQ(CallsOf((*servers_)[0]).MeshBytes(name), mesh);
  EXPECT_EQ(CallsOf((*servers_)[0]).Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
}

// Among all faults clients go on: nothing that was acknowledged is lost, nothing is done twice, and no two owners write
// in between each other.
TEST_F(PartitionsTest, NothingIsLostAmongClientsThatGoOn) {
  const WriteRecorder writes(*database_, database_->last_database());
  const Recorded recorded = RecordAmongFaults({proxy_->address()}, kClients, kFaults, AllFaults(), kServers, kPatience);
  const std::vector<DatabaseWrite> written = writes.Read();
  EXPECT_EQ(CheckMergedHistory(written, recorded.told), "");
  std::cout << recorded.lives << " lives of sessions, " << recorded.told.size() << " acknowledged calls, "
            << written.size() << " writes; servers that ended by themselves: " << ended_ << "\n";
  for (const auto& [kind, count] : recorded.faults) {
    std::cout << "  " << count << " " << kind << "\n";
  }
}

}  // namespace
}  // namespace wellspace::server
