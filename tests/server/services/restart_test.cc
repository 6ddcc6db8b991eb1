// Sessions of a server with a folder, over restarts.
#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/synchronization/notification.h"
#include "gtest/gtest.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "server/store/durable_log.h"
#include "server/wire/errors.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/passing_log.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

constexpr absl::Duration kLong = absl::Minutes(1);

// Has no room for the first deletions.
class FullRecords final : public PassingRecords {
 public:
  FullRecords(std::shared_ptr<SessionLog> log, int refusals) : PassingRecords(std::move(log)), left_(refusals) {}

  absl::Status Apply(const SessionChange& change, Survives survives) override {
    if (change.is_deletion && left_-- > 0) {
      return MakeError(v1::ERROR_REASON_DISK_FULL, "no room");
    }
    absl::Status status = PassingRecords::Apply(change, survives);
    if (change.is_deletion && status.ok()) {
      is_deleted_.Notify();
    }
    return status;
  }
  bool WaitUntilDeleted() { return is_deleted_.WaitForNotificationWithTimeout(kLong); }

 private:
  std::atomic<int> left_;
  absl::Notification is_deleted_;
};

// A server over the folder of the test, as often as it is started.
class RestartTest : public ::testing::Test {
 protected:
  ~RestartTest() override {
    Stop();
    const absl::StatusOr<DataReport> report = CheckData(folder_.path());
    EXPECT_TRUE(report.ok() && report->is_whole() && report->unknown.empty())
        << report.status() << (report.ok() && !report->problems.empty() ? report->problems[0] : "");
  }

  void Start(MesherFactory create_mesher = core::Mesher::Create) {
    absl::StatusOr<std::unique_ptr<SessionLog>> log = OpenDurableLog({.folder = folder_.path()});
    ASSERT_TRUE(log.ok()) << log.status();
    StartOn(*std::move(log), std::move(create_mesher));
  }

  void StartOn(std::unique_ptr<SessionLog> log, MesherFactory create_mesher = core::Mesher::Create) {
    service_.emplace(FakeMesher, options_, Transport::kInProcess, FakeEstimator, std::move(create_mesher),
                     SecurityOptions(), std::move(log));
    calls_.emplace(service_->channel());
  }

  void Stop() {
    calls_.reset();
    service_.reset();
  }

  // Ends the server, and starts it again. Running work is given up, as after SIGTERM.
  void Restart(MesherFactory create_mesher = core::Mesher::Create) {
    Stop();
    Start(std::move(create_mesher));
  }

  SessionCalls& calls() { return *calls_; }

  // A session with points in the unit square.
  std::string SessionWithPoints(size_t count = 200, uint64_t seed = 1) {
    std::string name = calls().Create(2).name();
    calls().Upload(name, 0, UniformPoints(count, 2, seed));
    return name;
  }

  std::string Seen(const std::string& name) {
    v1::Session session = calls().Get(name);
    session.clear_expire_time();
    return session.DebugString();
  }

  std::string MeshOf(const std::string& name) { return calls().MeshBytes(name); }

  v1::AddVerticesResponse Add(const std::string& name, const std::vector<double>& points,
                              const std::string& request_id = "") {
    grpc::ClientContext context;
    v1::AddVerticesRequest request;
    request.set_name(name);
    request.mutable_points()->Assign(points.begin(), points.end());
    request.set_request_id(request_id);
    v1::AddVerticesResponse response;
    const grpc::Status status = calls().queries().AddVertices(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  v1::Operation WaitFor(const std::string& operation) {
    Watch watch(calls().operations(), operation, std::nullopt, kLong);
    EXPECT_TRUE(watch.Finish().ok());
    return watch.operation.value_or(v1::Operation());
  }

  TestFolder folder_;
  ServiceOptions options_{.workers = 2};
  std::optional<ServiceHarness> service_;
  std::optional<SessionCalls> calls_;
};

TEST_F(RestartTest, SessionsAreThereWithAllThatIsSaidOfThem) {
  Start();
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(2);
  request.mutable_parameters()->set_max_circumradius(0.25);
  (*request.mutable_labels())["project"] = "wing";
  request.mutable_ttl()->set_seconds(500);
  const std::string empty = calls().Create(request).name();
  const std::string uploaded = SessionWithPoints();
  const std::string refined = SessionWithPoints();
  calls().Refine(refined);
  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name(uploaded);
  (*update.mutable_session()->mutable_labels())["project"] = "hull";
  update.mutable_session()->mutable_ttl()->set_seconds(77);
  calls().Update(update);
  const std::vector<std::string> before = {Seen(empty), Seen(uploaded), Seen(refined)};
  const std::string list = calls().List({}).sessions_size() == 3 ? "three" : "other";
  for (int i = 0; i < 3; ++i) {
    Restart();
    EXPECT_EQ(Seen(empty), before[0]);
    EXPECT_EQ(Seen(uploaded), before[1]);
    EXPECT_EQ(Seen(refined), before[2]);
    const v1::ListSessionsResponse listed = calls().List({});
    ASSERT_EQ(listed.sessions_size(), 3);
    EXPECT_EQ(listed.sessions(0).name(), empty) << "in the order of their creation";
    EXPECT_EQ(listed.sessions(2).name(), refined);
  }
  EXPECT_EQ(list, "three");
}

TEST_F(RestartTest, WhatWasDeletedStaysAway) {
  Start();
  const std::string name = SessionWithPoints();
  calls().Refine(name);
  calls().Delete(name);
  Restart();
  grpc::Status status;
  calls().Get(name, &status);
  EXPECT_EQ(DetailsOf(status).reason, "SESSION_NOT_FOUND");
  EXPECT_EQ(calls().List({}).sessions_size(), 0);
}

TEST_F(RestartTest, MeshesAndDownloadsGoOn) {
  Start();
  const std::string name = SessionWithPoints(20'000);
  const uint64_t revision = calls().Refine(name).mesh_revision();
  const Download whole = calls().DownloadMesh(name, revision, 0, std::nullopt, true);
  ASSERT_GT(whole.chunks.size(), 2u);
  Restart();
  const Download rest = calls().DownloadMesh(name, revision, 1, std::nullopt, true);
  ASSERT_TRUE(rest.status.ok()) << rest.status.error_message();
  EXPECT_EQ(rest.metadata[0].SerializeAsString(), whole.metadata[0].SerializeAsString());
  ASSERT_EQ(rest.chunks.size(), whole.chunks.size() - 1);
  for (size_t i = 0; i < rest.chunks.size(); ++i) {
    EXPECT_EQ(rest.chunks[i].SerializeAsString(), whole.chunks[i + 1].SerializeAsString()) << i;
  }
}

TEST_F(RestartTest, UploadsGoOnAndNothingIsTakenTwice) {
  Start();
  const std::vector<double> points = UniformPoints(1000, 2, 3);
  const std::string name = calls().Create(2).name();
  calls().Upload(name, 0, {points.begin(), points.begin() + 800});
  Restart();
  EXPECT_EQ(calls().Get(name).committed_points(), 400u);
  EXPECT_EQ(calls().Upload(name, 300, {points.begin() + 600, points.end()}).committed_points(), 1000u);
  grpc::Status status;
  calls().Upload(name, 0, {0.5, 0.5}, &status);
  EXPECT_EQ(DetailsOf(status).reason, "UPLOAD_MISMATCH");
}

// The life of a session, with a restart wherever `restarts` has its bit; its end is compared.
TEST_F(RestartTest, WhateverTheRestartsTheMeshesAreTheSameToTheBit) {
  const auto live = [&](uint32_t restarts) {
    int step = 0;
    const auto maybe_restart = [&] {
      if ((restarts >> step++ & 1) != 0) {
        Restart();
      }
    };
    const std::vector<double> points = UniformPoints(600, 2, 7);
    const std::string name = calls().Create(2).name();
    calls().Upload(name, 0, {points.begin(), points.begin() + 800});
    maybe_restart();
    calls().Refine(name);
    maybe_restart();
    calls().Upload(name, 400, {points.begin() + 800, points.begin() + 1000});
    maybe_restart();
    std::string seen = Add(name, {points.begin() + 1000, points.begin() + 1100}).DebugString();
    maybe_restart();
    v1::StartRefinementRequest finer;
    finer.set_name(name);
    *finer.mutable_parameters() = UnitCubeParameters(2);
    finer.mutable_parameters()->set_max_circumradius(0.05);
    EXPECT_EQ(WaitFor(calls().Start(finer).name()).state(), v1::Operation::STATE_SUCCEEDED);
    maybe_restart();
    seen += Add(name, {points.begin() + 1100, points.end()}).DebugString();
    maybe_restart();
    calls().Refine(name);
    maybe_restart();
    v1::Session session = calls().Get(name);
    seen += std::to_string(session.revision()) + " " + std::to_string(session.vertex_count());
    return seen + MeshOf(name);
  };
  Start();
  const std::string undisturbed = live(0);
  for (const uint32_t restarts :
       {0b1111111u, 0b1u, 0b10u, 0b100u, 0b1000u, 0b10000u, 0b100000u, 0b1000000u, 0b0101010u}) {
    EXPECT_TRUE(live(restarts) == undisturbed) << restarts;
  }
}

TEST_F(RestartTest, DomainsComeBackWithTheirSegments) {
  Start();
  const std::string name = calls().Create(2).name();
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  const std::string domain = calls().Create(create).name();
  const std::string other = calls().Create(create).name();
  for (const std::string& one : {domain, other}) {
    calls().Upload(one, 0, FramePoints());
    calls().AddSegments({FrameRequest(one)});
  }
  calls().Refine(other);
  const std::string before = Seen(domain);
  Restart();
  EXPECT_EQ(Seen(domain), before);
  v1::AddSegmentsResponse again = calls().AddSegments({FrameRequest(domain)});  // all is known, and nothing changes
  EXPECT_EQ(again.segment_count(), 10u);
  EXPECT_EQ(Seen(domain), before);
  calls().Refine(domain);
  EXPECT_EQ(MeshOf(domain), MeshOf(other));
}

TEST_F(RestartTest, SurfacesComeBackWithTheirTrianglesAndSeeds) {
  Start();
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(3);
  const std::string block = calls().Create(create).name();
  const std::string other = calls().Create(create).name();
  for (const std::string& one : {block, other}) {
    calls().Upload(one, 0, BlockPoints());
    calls().AddTriangles({BlockRequest(one)});
  }
  calls().Refine(other);
  const std::string before = Seen(block);
  Restart();
  EXPECT_EQ(Seen(block), before);
  const v1::AddTrianglesResponse again = calls().AddTriangles({BlockRequest(block)});
  EXPECT_EQ(again.triangle_count(), 12u);
  EXPECT_EQ(Seen(block), before) << "all is known, and nothing changes";
  calls().Refine(block);
  EXPECT_EQ(MeshOf(block), MeshOf(other));
  Restart();
  for (const std::string& one : {block, other}) {
    v1::StartRefinementRequest finer;
    finer.set_name(one);
    finer.mutable_parameters()->set_dimension(3);
    finer.mutable_parameters()->mutable_surface()->set_edge_length(0.25);
    EXPECT_EQ(calls().Refine(finer).state(), v1::Operation::STATE_SUCCEEDED);
  }
  EXPECT_EQ(MeshOf(block), MeshOf(other)) << "their structures are built again";
}

TEST_F(RestartTest, DomainsComeBackWithTheirGroupsAndDistances) {
  Start();
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  create.mutable_parameters()->set_merge_distance(0.01);
  // Two features of a map, one in the other, and a point near to a side: without groups the inner one would be a hole.
  v1::AddSegmentsRequest request = FrameRequest("");
  request.mutable_segments()->mutable_ends()->Truncate(16);
  request.mutable_segments()->mutable_markers()->Truncate(8);
  for (const uint32_t group : {3, 3, 3, 3, 8, 8, 8, 8}) {
    request.mutable_segments()->add_groups(group);
  }
  request.mutable_faces()->clear_seeds();
  request.mutable_faces()->set_faces(v1::FACE_RULE_UNION);
  request.mutable_faces()->set_crossings(v1::CROSSING_RULE_SNAP);
  request.mutable_faces()->set_snap_distance(0.25);
  const std::string domain = calls().Create(create).name();
  const std::string other = calls().Create(create).name();
  for (const std::string& one : {domain, other}) {
    std::vector<double> points = FramePoints();
    points.insert(points.end(), {points[0] + (points[2] - points[0]) / 3, points[1] + 0.125});
    calls().Upload(one, 0, points);
    request.set_name(one);
    calls().AddSegments({request});
  }
  calls().Refine(other);
  EXPECT_EQ(calls().Get(domain).faces(), v1::FACE_RULE_UNION);
  EXPECT_EQ(calls().Get(domain).snap_distance(), 0.25);
  const std::string before = Seen(domain);
  Restart();
  EXPECT_EQ(Seen(domain), before);
  request.set_name(domain);
  calls().AddSegments({request});
  EXPECT_EQ(Seen(domain), before) << "all is known, and nothing changes";
  calls().Refine(domain);
  EXPECT_EQ(MeshOf(domain), MeshOf(other));
}

TEST_F(RestartTest, RequestsThatWereAnsweredAreNotDoneAgain) {
  Start();
  v1::CreateSessionRequest create;
  *create.mutable_parameters() = UnitCubeParameters(2);
  create.set_request_id("create");
  const v1::Session created = calls().Create(create);
  calls().Upload(created.name(), 0, UniformPoints(100, 2, 1));
  v1::StartRefinementRequest start;
  start.set_name(created.name());
  start.set_request_id("start");
  const v1::Operation started = calls().Start(start);
  WaitFor(started.name());
  const v1::AddVerticesResponse added = Add(created.name(), {0.5, 0.25}, "add");
  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name(created.name());
  update.set_request_id("update");
  const v1::Session updated = calls().Update(update);
  const std::string doomed = calls().Create(2).name();
  v1::DeleteSessionRequest remove;
  remove.set_name(doomed);
  remove.set_request_id("delete");
  calls().Delete(remove);
  Restart();
  const std::string before = Seen(created.name());
  EXPECT_EQ(calls().Create(create).SerializeAsString(), created.SerializeAsString());
  EXPECT_EQ(calls().Start(start).SerializeAsString(), started.SerializeAsString());
  EXPECT_EQ(Add(created.name(), {0.5, 0.25}, "add").SerializeAsString(), added.SerializeAsString());
  EXPECT_EQ(calls().Update(update).SerializeAsString(), updated.SerializeAsString());
  calls().Delete(remove);
  EXPECT_EQ(Seen(created.name()), before);
  EXPECT_EQ(calls().List({}).sessions_size(), 1);
  start.set_expected_revision(99);
  grpc::Status status;
  calls().Start(start, &status);
  EXPECT_EQ(DetailsOf(status).reason, "REQUEST_ID_REUSED");
}

TEST_F(RestartTest, OperationsThatWereUnderWayGoOnUnderTheirNames) {
  Event begun;
  Start(ScriptedMesher(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); })));
  options_.workers = 1;
  const std::string running = SessionWithPoints();
  const std::string queued = SessionWithPoints();
  const std::string first = calls().Start(running).name();
  ASSERT_TRUE(begun.Wait());
  const std::string second = calls().Start(queued).name();
  Watch before(calls().operations(), first);
  ASSERT_TRUE(before.ReadUntil(v1::PHASE_REFINEMENT));
  const uint64_t heard = before.events.back().sequence();
  before.Cancel();
  before.Finish();
  Restart();
  Watch after(calls().operations(), first, heard, kLong);
  EXPECT_TRUE(after.Finish().ok());
  ASSERT_FALSE(after.events.empty()) << "its numbers are larger than those of the process before";
  EXPECT_GT(after.events.front().sequence(), heard);
  ASSERT_TRUE(after.operation.has_value());
  EXPECT_EQ(after.operation->state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(WaitFor(second).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(calls().Get(running).state(), v1::Session::STATE_READY);
  EXPECT_EQ(calls().Get(running).last_operation(), first);
  const std::string fresh = SessionWithPoints();
  calls().Refine(fresh);
  EXPECT_EQ(MeshOf(running), MeshOf(fresh));
}

// Segments and sizes are read when they are needed, and an operation that goes on needs them.
TEST_F(RestartTest, OperationsGoOnWithSegmentsAndSizes) {
  Event begun;
  Start(ScriptedMesher(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); })));
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  const auto fill = [&] {
    const std::string name = calls().Create(create).name();
    calls().Upload(name, 0, FramePoints());
    calls().AddSegments({FrameRequest(name)});
    calls().SetSizes({SizesRequest(name, {0.5, 0.5}, {0.05})});
    return name;
  };
  const std::string name = fill();
  const std::string operation = calls().Start(name).name();
  ASSERT_TRUE(begun.Wait());
  Restart();
  EXPECT_EQ(WaitFor(operation).state(), v1::Operation::STATE_SUCCEEDED);
  const std::string fresh = fill();
  calls().Refine(fresh);
  EXPECT_EQ(MeshOf(name), MeshOf(fresh));
}

// Each set of sizes that a step kept to is needed again, and no other.
TEST_F(RestartTest, SizesComeBackWithTheStepsThatKeptToThem) {
  const auto live = [&](bool restarts) {
    const std::string name = SessionWithPoints();
    const auto may_restart = [&] {
      if (restarts) {
        Restart();
      }
    };
    for (const double size : {0.05, 0.02, 0.01}) {
      calls().SetSizes({SizesRequest(name, {size * 10, 0.5}, {1})});  // of no use
      may_restart();
      calls().SetSizes({SizesRequest(name, {size * 10, 0.5}, {size})});
      may_restart();
      calls().Refine(name);
      may_restart();
      Add(name, {size, size});
    }
    may_restart();
    v1::StartRefinementRequest restart;
    restart.set_name(name);
    restart.set_restart(true);
    const std::string before = MeshOf(name);
    EXPECT_TRUE(calls().Refine(restart).restart());
    EXPECT_NE(MeshOf(name), before);
    may_restart();
    calls().SetSizes({SizesRequest(name, {0.9, 0.9}, {0.02})});
    calls().Refine(name);
    may_restart();
    Add(name, {0.51, 0.52});
    calls().Refine(name);
    EXPECT_EQ(calls().Get(name).size_count(), 1u);
    return MeshOf(name);
  };
  Start();
  const std::string undisturbed = live(false);
  EXPECT_EQ(live(true), undisturbed);
}

TEST_F(RestartTest, WatchersOfAnEndedOperationHearItsLastEventOnce) {
  Start();
  const std::string name = SessionWithPoints();
  const v1::Operation operation = calls().Refine(name);
  Restart();
  Watch watch(calls().operations(), operation.name(), operation.progress().sequence(), kLong);
  EXPECT_TRUE(watch.Finish().ok());
  ASSERT_EQ(watch.events.size(), 1u);
  EXPECT_EQ(watch.events[0].phase(), v1::PHASE_DONE);
  Watch again(calls().operations(), operation.name(), watch.events[0].sequence(), kLong);
  EXPECT_TRUE(again.Finish().ok());
  EXPECT_TRUE(again.events.empty());
  EXPECT_EQ(again.operation->mesh_revision(), operation.mesh_revision());
  EXPECT_EQ(again.operation->end_time().seconds(), operation.end_time().seconds());
}

TEST_F(RestartTest, WhatAClientHasCancelledIsNotTakenUpAgain) {
  Event begun;
  // Does not hear that it is cancelled until the server ends.
  Start(ScriptedMesher(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); })));
  const std::string name = SessionWithPoints();
  const std::string operation = calls().Start(name).name();
  ASSERT_TRUE(begun.Wait());
  calls().Cancel(operation);
  EXPECT_EQ(WaitFor(operation).state(), v1::Operation::STATE_CANCELLED);
  Restart();
  EXPECT_EQ(calls().GetOperation(operation).state(), v1::Operation::STATE_CANCELLED);
  EXPECT_EQ(calls().Get(name).state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(calls().Refine(name).name(), name + "/operations/2") << "numbers are not given twice";
}

// Its end is written down once there is room, not only by the next start.
TEST_F(RestartTest, ASessionThatExpiresOnAFullDiskIsFreedLater) {
  std::shared_ptr<SessionLog> log = OpenDurableLog({.folder = folder_.path()}).value();
  auto records = std::make_unique<FullRecords>(log, /*refusals=*/2);
  FullRecords& full = *records;
  auto files = std::make_unique<PassingFiles>(std::exchange(log, nullptr));
  StartOn(std::make_unique<SessionLog>(std::move(records), std::move(files)));
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(2);
  request.mutable_ttl()->set_seconds(1);
  const std::string name = calls().Create(request).name();
  EXPECT_TRUE(full.WaitUntilDeleted());
  Restart();
  EXPECT_EQ(calls().List({}).sessions_size(), 0) << name;
}

TEST_F(RestartTest, ADamagedMeshCostsItsSessionAlone) {
  Start();
  const std::string damaged = SessionWithPoints();
  const std::string other = SessionWithPoints();
  const uint64_t revision = calls().Refine(damaged).mesh_revision();
  calls().Refine(other);
  Stop();
  const std::string path = DataPaths{folder_.path()}.mesh(damaged, revision, /*epoch=*/1);
  FlipBit(path, 100, 3);
  Start();
  const Download download = calls().DownloadMesh(damaged);
  EXPECT_EQ(DetailsOf(download.status).reason, "FILE_DAMAGED");
  v1::LocateRequest locate;
  locate.mutable_points()->Add(0.5);
  locate.mutable_points()->Add(0.5);
  v1::LocateResponse located;
  for (int i = 0; i < 2; ++i) {
    grpc::ClientContext context;
    locate.set_name(damaged);
    EXPECT_EQ(DetailsOf(calls().queries().Locate(&context, locate, &located)).reason, "FILE_DAMAGED");
  }
  grpc::ClientContext context;
  locate.set_name(other);
  EXPECT_TRUE(calls().queries().Locate(&context, locate, &located).ok());
  EXPECT_NE(download.status.error_message().find(path.substr(path.rfind('/'))), std::string::npos)
      << download.status.error_message();
  EXPECT_TRUE(calls().DownloadMesh(other).status.ok());
  EXPECT_TRUE(service_->log().WaitFor("cause=\"" + path)) << "where the folder is, is for the log alone";
  EXPECT_EQ(download.status.error_message().find(folder_.path()), std::string::npos);
  EXPECT_EQ(download.status.error_details().find(folder_.path()), std::string::npos);
  Stop();
  FlipBit(path, 100, 3);
}

}  // namespace
}  // namespace wellspace::server
