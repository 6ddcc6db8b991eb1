// Two processes on one folder: one that was stopped while it owned a session, and goes on when another owns it.
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/sessions/session_registry.h"
#include "server/store/ballast.h"
#include "server/store/check_data.h"
#include "server/store/folder_files.h"
#include "server/store/sqlite_records.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::SizeIs;

// A process, but for the lock of the folder, which keeps two of one machine apart.
class Process {
 public:
  explicit Process(const std::shared_ptr<DataFolder>& folder) {
    const auto ballast = std::make_shared<Ballast>(PosixFileSystem(), folder->paths().ballast(), 0);
    const auto health = std::make_shared<StoreHealth>(nullptr, ballast);
    log_ = std::make_unique<SessionLog>(
        SqliteRecords::Open(folder, SessionTables::Open(folder->paths().database(), {}).value(), health, ballast)
            .value(),
        FolderFiles::Open(folder, health, {}).value());
    registry_.emplace(options_, memory_, Clock{.since_boot = [this] { return SinceBoot() + later_; }}, *log_);
    const StoredSessions before = log_->records().Load().value();
    for (const StoredSession& stored : before.sessions) {
      session_ = registry_->Restore(stored).value();
      resumed_ = session_->ResumeOperation().value();
    }
  }

  Session& Create() {
    session_ =
        registry_->Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = absl::Hours(1)}).value();
    return *session_;
  }

  // Has an operation worked at until its mesh is kept, and not yet named.
  WorkResult Work(Operation& operation) {
    core::RunContext context;
    std::optional<SessionWork> work = session_->BeginWork(operation);
    work->mesher = script_(operation.parameters(), {}, context).value();
    return {.status = absl::OkStatus(),
            .work = *std::move(work),
            .mesh = session_->KeepMesh(MakeMesh({.dimension = 2}), context).value()};
  }

  std::shared_ptr<Operation> Start() {
    return session_
        ->StartOperation({.dimension = 2}, /*restart=*/false, 0,
                         [](const std::shared_ptr<Operation>& /*operation*/) { return absl::OkStatus(); })
        .value();
  }

  void Refine() {
    const std::shared_ptr<Operation> operation = Start();
    WorkResult result = Work(*operation);
    ASSERT_TRUE(session_->EndWork(*operation, result));
    ASSERT_TRUE(result.status.ok()) << result.status;
  }

  void Upload(const std::vector<double>& points) {
    ASSERT_TRUE(session_->Append(session_->Describe().committed_points(), points, 0).ok());
    ASSERT_TRUE(session_->CommitPoints().ok());
  }

  // The process has run for so much longer.
  void Wait(absl::Duration time) { later_ += time; }

  Session& session() { return *session_; }
  SessionLog& log() { return *log_; }
  SessionRegistry& registry() { return *registry_; }
  const std::shared_ptr<Operation>& resumed() const { return resumed_; }

 private:
  absl::Duration later_;
  ServiceOptions options_;
  MemoryBudget memory_{0};
  MesherFactory script_ = ScriptedMesher([](core::Phase, core::RunContext&) { return absl::OkStatus(); });
  std::unique_ptr<SessionLog> log_;
  std::optional<SessionRegistry> registry_;
  std::shared_ptr<Session> session_;
  std::shared_ptr<Operation> resumed_;
};

class OwnershipTest : public ::testing::Test {
 protected:
  std::set<std::string> Files() const {
    const std::vector<std::string> names = PosixFileSystem().List(folder_->paths().files()).value();
    return {names.begin(), names.end()};
  }
  // The files that the records name, of all owners.
  std::set<std::string> Named(Process& process) const {
    std::set<std::string> named;
    const Census census = process.log().records().ReadCensus().value();
    for (const store::v1::SessionRecord& session : census.sessions) {
      for (const std::string& path : FilesOf(folder_->paths(), session)) {
        named.insert(std::filesystem::path(path).filename());
      }
    }
    return named;
  }
  static std::vector<double> PointsOf(Session& session) {
    return session.inputs().points->CopyFrom(0, core::RunContext()).value();
  }

  const TestFolder root_;
  const std::shared_ptr<DataFolder> folder_ = DataFolder::Open(root_.path(), PosixFileSystem()).value();
};

TEST_F(OwnershipTest, AnOfferEndsWithTheBeginOfTheWork) {
  Process process(folder_);
  process.Create();
  process.Upload({0, 0, 1, 0, 0, 1});
  Session& session = process.session();
  EXPECT_TRUE(session.SetOffer(true).ok());
  EXPECT_FALSE(session.IsOffered()) << "no operation waits";
  const std::shared_ptr<Operation> operation = process.Start();
  EXPECT_FALSE(session.GetWaiting()->is_offered);
  for (const bool stands : {true, true, false, false, true}) {
    EXPECT_TRUE(session.SetOffer(stands).ok());
    EXPECT_EQ(session.IsOffered(), stands);
    EXPECT_EQ(session.GetWaiting()->is_offered, stands);
  }
  EXPECT_TRUE(session.Update({{{"a", "b"}}}, std::nullopt, 0).ok());
  EXPECT_TRUE(session.IsOffered()) << "the operation waits still";
  WorkResult result = process.Work(*operation);
  EXPECT_FALSE(session.IsOffered());
  EXPECT_FALSE(session.GetWaiting().has_value());
  EXPECT_TRUE(session.SetOffer(true).ok());
  EXPECT_FALSE(session.IsOffered()) << "what has begun is not offered";
  EXPECT_TRUE(session.EndWork(*operation, result));
  EXPECT_TRUE(result.status.ok());
  const std::shared_ptr<Operation> cancelled = process.Start();
  EXPECT_FALSE(session.GetWaiting()->is_read);
  {
    const std::shared_ptr<const MeshSnapshot> read = session.meshes().last();
    EXPECT_TRUE(session.GetWaiting()->is_read);
  }
  EXPECT_TRUE(session.GetWaiting()->has_structure);
  EXPECT_TRUE(session.SetOffer(true).ok());
  EXPECT_TRUE(session.Cancel(*cancelled).ok());
  EXPECT_FALSE(session.IsOffered());
}

TEST_F(OwnershipTest, WhatAnotherHasTakenDoesNotBegin) {
  Process old(folder_);
  old.Create();
  old.Upload({0, 0, 1, 0, 0, 1});
  const std::shared_ptr<Operation> waiting = old.Start();
  int notices = 0;
  waiting->Watch([&] { ++notices; });
  ASSERT_TRUE(old.session().SetOffer(true).ok());

  Process owner(folder_);
  ASSERT_NE(owner.resumed(), nullptr);
  EXPECT_FALSE(owner.resumed()->IsSuspect());
  EXPECT_FALSE(owner.session().IsOffered());
  EXPECT_FALSE(old.session().BeginWork(*waiting).has_value());
  EXPECT_TRUE(waiting->IsQueued());
  EXPECT_TRUE(old.session().IsElsewhere());
  EXPECT_EQ(notices, 0);
  EXPECT_EQ(old.session().GiveAway("owner:7233"), nullptr) << "it has no job";
  EXPECT_EQ(notices, 1);
  EXPECT_THAT(std::string(old.session().Tell(*waiting).status().message()), HasSubstr("owner:7233"));
  EXPECT_FALSE(old.session().GetWaiting().has_value());
  old.Wait(absl::Hours(2));
  EXPECT_TRUE(old.session().CloseIfExpired()) << "nothing keeps it here";
  WorkResult result = owner.Work(*owner.resumed());
  EXPECT_TRUE(owner.session().EndWork(*owner.resumed(), result));
  EXPECT_TRUE(result.status.ok());
}

// The registry takes out the session that it is given, and not one of its name that has come back meanwhile.
TEST_F(OwnershipTest, WhatHasComeBackStays) {
  Process process(folder_);
  const std::string name = process.Create().name();
  const std::shared_ptr<Session> before = process.registry().FindHere(name);
  const StoredSession taken = process.log().records().Take(name).value().value();
  ASSERT_TRUE(process.registry().Restore(taken).ok());
  EXPECT_FALSE(process.registry().Remove(*before));
  const std::shared_ptr<Session> after = process.registry().FindHere(name);
  ASSERT_NE(after, nullptr);
  EXPECT_NE(after, before);
  EXPECT_TRUE(process.registry().Remove(*after));
}

TEST_F(OwnershipTest, AnOwnerThatWasStoppedChangesNothingWhenItGoesOn) {
  Process old(folder_);
  const std::string name = old.Create().name();
  old.Upload({0, 0, 1, 0, 0, 1});
  old.Refine();
  // It is stopped in the middle of an upload, and of an operation whose mesh is on the disk.
  const std::shared_ptr<Operation> under_way = old.Start();
  WorkResult result = old.Work(*under_way);
  int notices = 0;
  under_way->Watch([&] { ++notices; });

  Process owner(folder_);
  ASSERT_NE(owner.resumed(), nullptr) << "its operation goes on here";
  ASSERT_TRUE(owner.session().Cancel(*owner.resumed()).ok());
  owner.Upload({1, 1, 0.5, 0.5});
  owner.Refine();
  const std::set<std::string> named = Named(owner);
  EXPECT_THAT(named, SizeIs(3)) << "points of both, and a mesh";
  const std::string before = owner.session().state()->record.DebugString();

  Session& lost = old.session();
  EXPECT_TRUE(old.session().EndWork(*under_way, result));
  EXPECT_EQ(ReasonOf(result.status), "SESSION_ELSEWHERE");
  EXPECT_EQ(notices, 1) << "its watchers are told";
  EXPECT_EQ(ReasonOf(old.session().Tell(*under_way).status()), "SESSION_ELSEWHERE")
      << "that it failed here is no news: it may go on, and succeed";
  result = WorkResult();
  EXPECT_EQ(ReasonOf(lost.Update(std::map<std::string, std::string>{{"key", "value"}}, std::nullopt, 0)),
            "SESSION_ELSEWHERE");
  EXPECT_EQ(ReasonOf(lost.Append(3, std::vector<double>{7, 7}, 0)), "SESSION_ELSEWHERE");
  EXPECT_EQ(ReasonOf(lost.SetSizes(nullptr, 0)), "SESSION_ELSEWHERE");
  EXPECT_EQ(ReasonOf(lost.RemovePoints(std::vector<uint64_t>{0}, 0).status()), "SESSION_ELSEWHERE");
  EXPECT_EQ(ReasonOf(lost.Close(0).status()), "SESSION_ELSEWHERE");
  EXPECT_TRUE(IsOwnedElsewhere(lost.LogExpiry())) << "nor does the session expire here";
  EXPECT_EQ(ReasonOf(old.registry().Find("a", name).status()), "SESSION_ELSEWHERE");
  EXPECT_TRUE(old.registry().List("a", absl::InfinitePast(), 10, {}).empty()) << "it answers as the owner no more";
  EXPECT_EQ(ReasonOf(old.registry()
                         .Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = absl::Hours(1)})
                         .status()),
            "SESSION_ELSEWHERE")
      << "no one would own what it creates";
  EXPECT_TRUE(IsOwnedElsewhere(old.log().RemoveGarbage().status()));

  EXPECT_THAT(Files(), IsSupersetOf(named)) << "nothing of the owner's is gone";
  EXPECT_EQ(owner.session().state()->record.DebugString(), before);
  EXPECT_EQ(PointsOf(owner.session()), (std::vector<double>{0, 0, 1, 0, 0, 1, 1, 1, 0.5, 0.5}));
  const absl::StatusOr<DataReport> report = CheckData(root_.path());
  EXPECT_TRUE(report.ok() && report->is_whole()) << report.status();
}

// Uploads of both go to files of their own, though they begin at the same point.
TEST_F(OwnershipTest, NeitherWritesWhereTheOtherDoes) {
  Process old(folder_);
  old.Create();
  old.Upload({0, 0, 1, 0, 0, 1});
  ASSERT_TRUE(old.session().Append(3, std::vector<double>{7, 7, 8, 8}, 0).ok());
  Process owner(folder_);
  ASSERT_TRUE(owner.session().Append(3, std::vector<double>{1, 1}, 0).ok());
  ASSERT_TRUE(old.session().Append(5, std::vector<double>{9, 9}, 0).ok()) << "it does not know yet";
  ASSERT_TRUE(owner.session().CommitPoints().ok());
  EXPECT_EQ(ReasonOf(old.session().CommitPoints()), "SESSION_ELSEWHERE");
  Process next(folder_);
  EXPECT_EQ(PointsOf(next.session()), (std::vector<double>{0, 0, 1, 0, 0, 1, 1, 1}));
  next.Upload({2, 2});
  EXPECT_EQ(PointsOf(next.session()), (std::vector<double>{0, 0, 1, 0, 0, 1, 1, 1, 2, 2}));
  EXPECT_EQ(next.session().state()->record.points_files_size(), 3);
  // Points that are taken out take all of these files with them.
  ASSERT_TRUE(next.session().RemovePoints(std::vector<uint64_t>{0}, 0).ok());
  EXPECT_EQ(PointsOf(next.session()), (std::vector<double>{1, 0, 0, 1, 1, 1, 2, 2}));
  EXPECT_THAT(Named(next), SizeIs(1));
}

// It has no place among the sessions of a server for longer than its lease.
TEST_F(OwnershipTest, ASessionThatIsElsewhereLeavesItsPlace) {
  Process old(folder_);
  const std::string name = old.Create().name();
  old.Upload({0, 0, 1, 0, 0, 1});
  Process owner(folder_);
  EXPECT_EQ(ReasonOf(old.session().Update(std::map<std::string, std::string>{{"key", "value"}}, std::nullopt, 0)),
            "SESSION_ELSEWHERE");
  EXPECT_THAT(old.registry().RemoveExpired(), SizeIs(0));
  EXPECT_EQ(old.registry().Count(), 1u);
  old.Wait(absl::Hours(2));
  EXPECT_THAT(old.registry().RemoveExpired(), SizeIs(1));
  EXPECT_EQ(old.registry().Count(), 0u);
  EXPECT_EQ(PointsOf(owner.session()), (std::vector<double>{0, 0, 1, 0, 0, 1})) << "there it goes on";
}

TEST_F(OwnershipTest, GarbageIsNothingThatALivingOwnerMakes) {
  Process old(folder_);
  old.Create();
  old.Upload({0, 0, 1, 0, 0, 1});
  Process owner(folder_);
  const std::shared_ptr<Operation> operation = owner.Start();
  WorkResult result = owner.Work(*operation);  // a mesh that no record names
  ASSERT_TRUE(owner.session().Cancel(*operation).ok());
  const std::set<std::string> before = Files();
  EXPECT_TRUE(IsOwnedElsewhere(old.log().RemoveGarbage().status()));
  EXPECT_THAT(owner.log().RemoveGarbage()->set_aside, SizeIs(0)) << "it makes it itself";
  EXPECT_EQ(Files(), before);
}

}  // namespace
}  // namespace wellspace::server
