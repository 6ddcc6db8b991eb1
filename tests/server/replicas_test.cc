// Real servers that share a PostgreSQL and a folder: where one ends, dies or stands still, another goes on.
#include <signal.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "client/error_details.h"
#include "client/mesh_sink.h"
#include "client/point_source.h"
#include "core/meshers/meshing_version.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/postgres_rows.h"
#include "tests/server/daemon.h"
#include "tests/server/mortal_replicas.h"
#include "tests/server/recorder.h"
#include "tests/server/replicas_fixture.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/postgres_server.h"
#include "tests/server/subprocess.h"
#include "tests/support/amount.h"

namespace wellspace::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

// Faults among clients that go on; the long test has more.
const int kFaults = test::Amount("WELLSPACE_FAULTS", 6);
constexpr int kClients = 3;

// That every kind of call works on a session that was made by another server, whose mesh was `mesh`.
void UseSession(Daemon& daemon, const std::string& name, const std::string& mesh, int operations = 1) {
  SessionCalls calls = CallsOf(daemon);
  EXPECT_EQ(calls.MeshBytes(name), mesh);
  EXPECT_THAT(calls.List({}).sessions(), SizeIs(1));
  EXPECT_THAT(calls
                  .ListOperations([&] {
                    v1::ListOperationsRequest request;
                    request.set_parent(name);
                    return request;
                  }())
                  .operations(),
              SizeIs(operations));
  grpc::ClientContext context;
  v1::AddVerticesRequest add;
  add.set_name(name);
  add.mutable_points()->Add(0.501);
  add.mutable_points()->Add(0.499);
  v1::AddVerticesResponse added;
  EXPECT_TRUE(calls.queries().AddVertices(&context, add, &added).ok());
  const uint64_t points = calls.Get(name).committed_points();
  calls.Upload(name, points, UniformPoints(50, 2, 2));
  EXPECT_EQ(calls.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name(name);
  update.mutable_update_mask()->add_paths("labels");
  (*update.mutable_session()->mutable_labels())["a"] = "b";
  EXPECT_EQ(calls.Update(update).labels().at("a"), "b");
  v1::RemovePointsRequest remove;
  remove.set_name(name);
  remove.add_points(0);
  EXPECT_EQ(calls.RemovePoints(remove).committed_points(), points + 49);
  EXPECT_EQ(calls.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  calls.Delete(name);
}

TEST_F(ReplicasTest, ASessionIsFoundWhereItIs) {
  const auto first = Start("first");
  const auto second = Start("second");
  const std::string name = MakeSession(*first);
  SessionCalls calls = CallsOf(*second);
  grpc::Status status;
  calls.Get(name, &status);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(DetailsOf(status).reason, "SESSION_ELSEWHERE");
  EXPECT_EQ(DetailsOf(status).address, first->address());
  EXPECT_TRUE(DetailsOf(status).may_retry);
  calls.Get("sessions/00000000000000000000000000000000", &status);
  EXPECT_EQ(DetailsOf(status).reason, "SESSION_NOT_FOUND");
  const std::string other = calls.Create(2).name();
  CallsOf(*first).Get(other, &status);
  EXPECT_EQ(DetailsOf(status).address, second->address());
  calls.Delete(other);
  CallsOf(*first).Get(other, &status);
  EXPECT_EQ(DetailsOf(status).reason, "SESSION_NOT_FOUND");
}

// A client of the library that was connected to one server goes through the life of a session of another one, which
// dies in the middle of it.
TEST_F(ReplicasTest, AClientGoesWhereTheSessionIs) {
  const auto first = Start("first");
  auto second = Start("second");
  client::Client client = first->Client();
  client::SessionOptions options;
  options.parameters.dimension = 2;
  const std::string name = second->Client().CreateSession(options)->name;
  const std::vector<double> points = UniformPoints(300, 2, 1);
  client::SpanSource source(2, points);
  const absl::StatusOr<client::Uploaded> uploaded = client.UploadPoints(name, source);
  ASSERT_TRUE(uploaded.ok()) << uploaded.status();
  EXPECT_EQ(uploaded->committed_points, 300u);
  const auto refine = [&] {
    const absl::StatusOr<client::Operation> started = client.StartRefinement(name);
    ASSERT_TRUE(started.ok()) << started.status();
    const absl::StatusOr<client::Operation> ended = client.WatchOperation(started->name);
    ASSERT_TRUE(ended.ok()) << ended.status();
    EXPECT_EQ(ended->state, client::OperationState::kSucceeded);
  };
  refine();
  const auto download = [&] {
    client::MeshCollector mesh;
    const absl::Status status = client.DownloadMesh(name, mesh);
    EXPECT_TRUE(status.ok()) << status;
    return std::move(mesh.mesh());
  };
  const client::Mesh before = download();
  EXPECT_GE(before.points.size(), points.size());
  EXPECT_EQ(second->Client().GetSession(name)->name, name) << "it is still there";
  second->process().Signal(SIGKILL);
  second->process().Wait();
  // The lease has to run out first; a client is patient for that long.
  const absl::StatusOr<client::Session> taken = client.GetSession(name);
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_EQ(taken->committed_points, 300u);
  EXPECT_EQ(first->Client().GetSession(name)->name, name) << "the first has it now";
  const client::Mesh after = download();
  EXPECT_EQ(after.points, before.points);
  EXPECT_EQ(after.simplices, before.simplices);
  const absl::StatusOr<client::AddedVertices> added = client.AddVertices(name, std::vector<double>{0.501, 0.499});
  ASSERT_TRUE(added.ok()) << added.status();
  refine();
  EXPECT_GT(download().points.size(), before.points.size());
  // Where following is off, the address is the caller's.
  const auto again = Start("second");
  client::ConnectOptions stay;
  stay.follow = false;
  client::CallOptions call;
  call.timeout = absl::Seconds(2);
  const absl::Status elsewhere = again->Client(stay).GetSession(name, call).status();
  EXPECT_EQ(client::OwnerAddressOf(elsewhere), first->address()) << elsewhere;
  EXPECT_EQ(again->Client().DeleteSession(name), absl::OkStatus());
  EXPECT_TRUE(absl::IsNotFound(client.GetSession(name).status()));
}

TEST_F(ReplicasTest, WhoIsKilledIsTakenOver) {
  auto first = Start("first");
  const auto second = Start("second");
  const std::string name = MakeSession(*first);
  const std::string mesh = CallsOf(*first).MeshBytes(name);
  first->process().Signal(SIGKILL);
  first->process().Wait();
  const absl::Time dead = absl::Now();
  AwaitSession(*second, name);
  EXPECT_LT(absl::Now() - dead, kLease + absl::Seconds(20)) << "no more than the lease, and a busy machine";
  UseSession(*second, name, mesh);
  EXPECT_THAT(TextOfFile(ErrorPath("second")), HasSubstr("event=taken_over sessions=1"));
}

// A server that is stopped gives its sessions back at once, and its work.
TEST_F(ReplicasTest, WhoIsDrainedHandsOver) {
  auto first = std::make_unique<Daemon>([&] {
    std::vector<std::string> options = Options("first");
    options.insert(options.end(), {"--grace", "0"});
    return options;
  }());
  const std::string name = MakeSession(*first);
  const std::string mesh = CallsOf(*first).MeshBytes(name);
  const auto second = Start("second");
  first->Stop();
  AwaitSession(*second, name);
  UseSession(*second, name, mesh);
}

// It stands still for longer than its lease, and goes on: what it has is another's by then.
TEST_F(ReplicasTest, WhoStoodStillChangesNothing) {
  const auto first = Start("first");
  const auto second = Start("second");
  const std::string name = MakeSession(*first);
  const std::string mesh = CallsOf(*first).MeshBytes(name);
  SessionCalls old = CallsOf(*first);
  const uint64_t points = old.Get(name).committed_points();
  first->process().Signal(SIGSTOP);
  AwaitSession(*second, name);
  SessionCalls calls = CallsOf(*second);
  // Of requests that wait for it while it stands still, none is done.
  std::atomic<int> done = 0;
  std::vector<std::jthread> waiting;
  for (int i = 0; i < 4; ++i) {
    waiting.emplace_back([&, i] {
      grpc::Status status;
      old.Upload(name, points, {0.1 * i, 0.5}, &status);
      done += status.ok() ? 1 : 0;
      v1::UpdateSessionRequest update;
      update.mutable_session()->set_name(name);
      update.mutable_update_mask()->add_paths("labels");
      (*update.mutable_session()->mutable_labels())["by"] = "the old one";
      old.Update(update, &status);
      done += status.ok() ? 1 : 0;
      old.Get(name, &status);
      done += status.ok() ? 1 : 0;
    });
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  first->process().Signal(SIGCONT);
  waiting.clear();
  EXPECT_EQ(done, 0);
  EXPECT_EQ(first->process().Wait(), 1) << "it has nothing any more, and is to be started again";
  EXPECT_THAT(TextOfFile(ErrorPath("first")), HasSubstr("the lease ran out"));
  EXPECT_EQ(calls.Get(name).committed_points(), points);
  EXPECT_TRUE(calls.Get(name).labels().empty());
  UseSession(*second, name, mesh);
  const auto again = Start("first");
  EXPECT_EQ(CallsOf(*again).List({}).sessions_size(), 0);
}

// A newer server, which meshes otherwise, has had the session: its mesh is there to the bit, and so is its input; work
// goes on with a structure of this one's own.
TEST_F(ReplicasTest, WhatANewerServerHasMadeIsKept) {
  auto newer = Start("newer");
  const auto older = Start("older");
  const std::string name = MakeSession(*newer);
  const std::string mesh = CallsOf(*newer).MeshBytes(name);
  newer->process().Signal(SIGKILL);
  newer->process().Wait();
  pqxx::connection connection(store_);
  pqxx::work transaction(connection);
  int changed = 0;
  for (const pqxx::row& row :
       transaction.exec("SELECT session, number, kind, record, crc32c FROM wellspace.steps ORDER BY number")) {
    store::v1::StepRecord step = sql::ParseStep(row).value();
    if (step.has_refined() && step.refined().begins()) {
      step.mutable_refined()->set_meshing_version(core::kMeshingVersion + 1);
      const std::string record = step.SerializeAsString();
      const std::string key = KeyOfStep(row[0].as<int64_t>(), row[1].as<int64_t>(), row[2].as<int64_t>());
      transaction.exec_params0("UPDATE wellspace.steps SET record = $3, crc32c = $4 WHERE session = $1 AND number = $2",
                               row[0].as<int64_t>(), row[1].as<int64_t>(), sql::Blob(record),
                               sql::Checksum(key, record));
      ++changed;
    }
  }
  transaction.commit();
  EXPECT_EQ(changed, 1);
  AwaitSession(*older, name);
  SessionCalls calls = CallsOf(*older);
  EXPECT_EQ(calls.MeshBytes(name), mesh);
  grpc::ClientContext context;
  v1::AddVerticesRequest add;
  add.set_name(name);
  add.mutable_points()->Add(0.501);
  add.mutable_points()->Add(0.499);
  v1::AddVerticesResponse added;
  const grpc::Status without = calls.queries().AddVertices(&context, add, &added);
  EXPECT_EQ(without.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << without.error_message();
  EXPECT_EQ(calls.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  UseSession(*older, name, calls.MeshBytes(name), /*operations=*/2);
}

// A server with a folder of its own becomes one of several, and alone again.
TEST_F(ReplicasTest, RecordsMoveToAndFro) {
  const auto move = [&](const std::vector<std::string>& arguments) {
    Subprocess process("wellspaced", arguments, ErrorPath("move"));
    EXPECT_EQ(process.Wait(), 0) << TextOfFile(ErrorPath("move"));
  };
  const std::vector<std::string> alone = {"--data", folder_.path()};
  std::string name;
  std::string mesh;
  {
    Daemon own(alone, ErrorPath("own"));
    name = MakeSession(own);
    mesh = CallsOf(own).MeshBytes(name);
    own.Stop();
  }
  EXPECT_EQ(Subprocess("wellspaced", {"move-data", folder_.path()}, ErrorPath("wrong")).Wait(), 2);
  EXPECT_THAT(TextOfFile(ErrorPath("wrong")), HasSubstr("wants --store"));
  move({"--store", store_, "move-data", folder_.path()});
  {
    const auto first = Start("first");
    EXPECT_EQ(CallsOf(*first).MeshBytes(name), mesh);
    EXPECT_EQ(CallsOf(*first).Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
    mesh = CallsOf(*first).MeshBytes(name);
    first->Stop();
  }
  move({"move-data", "--back", "--store", store_, folder_.path()});
  Daemon own(alone, ErrorPath("own"));
  UseSession(own, name, mesh, /*operations=*/2);
}

TEST_F(ReplicasTest, TwoOfOneNameDoNotServeAtOnce) {
  const auto first = Start("one");
  std::vector<std::string> options = Options("one");
  options.insert(options.end(), {"--listen", "127.0.0.1:0"});
  Subprocess second("wellspaced", options, ErrorPath("second"));
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(TextOfFile(ErrorPath("second")), HasSubstr("another server with the name 'one'"));
  EXPECT_EQ(MakeSession(*first).substr(0, 9), "sessions/");
}

TEST_F(ReplicasTest, ThePasswordIsNowhere) {
  // Trusted by this server, whatever the password is.
  store_.replace(store_.find("@"), 1, ":s%45cret@");
  {
    const auto first = Start("first");
    MakeSession(*first);
    first->Stop();
  }
  EXPECT_THAT(TextOfFile(ErrorPath("first")),
              AllOf(HasSubstr("store=postgresql://tester@127.0.0.1"), Not(HasSubstr("cret"))));
  EXPECT_THAT(TextOfFile(absl::StrCat(folder_.path(), "/store")), Not(HasSubstr("cret")));
  const auto fails = [&](const std::string& store) {
    store_ = store;
    std::vector<std::string> options = Options("first");
    options.insert(options.end(), {"--listen", "127.0.0.1:0"});
    Subprocess process("wellspaced", options, ErrorPath("failed"));
    EXPECT_GT(process.Wait(), 0);
    std::string text = TextOfFile(ErrorPath("failed"));
    std::remove(ErrorPath("failed").c_str());
    return text;
  };
  EXPECT_THAT(fails("postgresql://tester:s%45cret@127.0.0.1:1/none"),
              AllOf(HasSubstr("postgresql://tester@127.0.0.1:1/none"), Not(HasSubstr("cret"))));
  EXPECT_THAT(fails("postgresql://tester:s%4cret@host/db"), AllOf(HasSubstr("--store"), Not(HasSubstr("cret"))));
  EXPECT_THAT(fails("postgresql://tester@host/db?passwort=secret"),
              AllOf(HasSubstr("--store"), Not(HasSubstr("cret"))));
}

// Servers die, are drained and stand still, and the database is restarted, while clients go on: all that any server has
// acknowledged is there, each request was done once.
TEST_F(ReplicasTest, NothingIsLostAmongClientsThatGoOn) {
  std::vector<MortalReplicas::Place> places;
  for (const std::string name : {"first", "second"}) {
    places.push_back({.options = Options(name), .address = "127.0.0.1:0", .error_path = ErrorPath(name)});
  }
  MortalReplicas replicas(std::move(places), kLease, PostgresServer::OfThisProgram());
  const Recorded recorded =
      RecordAmongFaults(replicas.addresses(), kClients, kFaults, replicas.Faults(), replicas.size());
  replicas.Stop();
  RecordProperty("sessions", recorded.lives);
  RecordProperty("redirected", recorded.redirected);
}

}  // namespace
}  // namespace wellspace::server
