// Sessions after the death of a process, without a server around them.
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "server/sessions/session_registry.h"
#include "server/store/durable_log.h"
#include "server/wire/errors.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/store/passing_log.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

// Records that can be away for a while, as a database is that is started again.
class AbsentRecords : public PassingRecords {
 public:
  AbsentRecords(std::shared_ptr<SessionLog> log, const bool& are_absent)
      : PassingRecords(std::move(log)), are_absent_(are_absent) {}

  absl::Status Apply(const SessionChange& change, Survives survives) override {
    return are_absent_ ? MakeError(v1::ERROR_REASON_STORE_FAILED, "the records are away")
                       : PassingRecords::Apply(change, survives);
  }

 private:
  const bool& are_absent_;
};

class RestoredSessionTest : public ::testing::Test {
 protected:
  RestoredSessionTest() {
    StartProcess();
    session_ =
        registry_->Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = absl::Hours(1)}).value();
  }

  // A new process: the memory of the one before is gone, whatever it was at.
  void StartProcess() {
    const std::string name = session_ == nullptr ? "" : session_->name();
    session_ = nullptr;
    registry_.reset();
    log_ = nullptr;
    log_ = LogAround<AbsentRecords>(OpenDurableLog({.folder = folder_.path()}).value(), are_absent_);
    registry_.emplace(options_, memory_, Clock{.since_boot = [this] { return since_boot_; }}, *log_);
    const StoredSessions before = log_->records().Load().value();
    for (const StoredSession& stored : before.sessions) {
      ASSERT_TRUE(registry_->Restore(stored).ok());
    }
    if (!name.empty()) {
      session_ = registry_->Find("a", name).value();
      resumed_ = session_->ResumeOperation().value();
    }
  }

  std::shared_ptr<Operation> StartOperation() {
    return session_
        ->StartOperation({.dimension = 2}, /*restart=*/false, 0,
                         [](const std::shared_ptr<Operation>& /*operation*/) { return absl::OkStatus(); })
        .value();
  }

  // Has the session refined, to a mesh that is none.
  void Refine() {
    const std::shared_ptr<Operation> operation = StartOperation();
    core::RunContext context;
    std::optional<SessionWork> work = session_->BeginWork(*operation);
    ASSERT_TRUE(work.has_value());
    work->mesher = script_(operation->parameters(), {}, context).value();
    WorkResult result{.status = absl::OkStatus(),
                      .work = *std::move(work),
                      .mesh = session_->KeepMesh(MakeMesh({.dimension = 2}), context).value()};
    ASSERT_TRUE(session_->EndWork(*operation, result));
    ASSERT_EQ(operation->Describe().state(), v1::Operation::STATE_SUCCEEDED);
  }

  absl::Duration since_boot_ = absl::Hours(1);
  bool are_absent_ = false;  // the records
  MesherFactory script_ = ScriptedMesher([](core::Phase, core::RunContext&) { return absl::OkStatus(); });
  TestFolder folder_;
  ServiceOptions options_;
  MemoryBudget memory_{0};
  std::shared_ptr<SessionLog> log_;
  std::optional<SessionRegistry> registry_;
  std::shared_ptr<Session> session_;
  std::shared_ptr<Operation> resumed_;  // by the last process
};

TEST_F(RestoredSessionTest, AnOperationInWhichThreeProcessesDiedIsNotTriedAgain) {
  const std::string name = StartOperation()->name();
  ASSERT_TRUE(session_->BeginWork(*session_->FindOperation(name).value()).has_value());
  for (const bool runs_alone : {false, true}) {
    StartProcess();
    ASSERT_NE(resumed_, nullptr);
    EXPECT_EQ(resumed_->name(), name);
    EXPECT_TRUE(resumed_->IsSuspect());
    EXPECT_EQ(resumed_->RunsAlone(), runs_alone);
    EXPECT_EQ(DetailsOf(session_->Append(0, std::vector<double>{0, 0}, 0)).reason, "SESSION_BUSY");
    ASSERT_TRUE(session_->BeginWork(*resumed_).has_value());
  }
  StartProcess();
  EXPECT_EQ(resumed_, nullptr);
  const v1::Operation operation = session_->FindOperation(name).value()->Describe();
  EXPECT_EQ(operation.state(), v1::Operation::STATE_FAILED);
  EXPECT_EQ(operation.error().code(), static_cast<int>(absl::StatusCode::kFailedPrecondition));
  EXPECT_TRUE(session_->Append(0, std::vector<double>{0, 0}, 0).ok()) << "the session is free";
  StartProcess();
  EXPECT_EQ(session_->FindOperation(name).value()->Describe().state(), v1::Operation::STATE_FAILED);
}

TEST_F(RestoredSessionTest, AFailureThatIsNotWrittenDownIsNoEnd) {
  const std::shared_ptr<Operation> operation = StartOperation();
  std::optional<SessionWork> work = session_->BeginWork(*operation);
  ASSERT_TRUE(work.has_value());
  WorkResult result{.status = absl::InternalError("it failed"), .work = *std::move(work), .mesh = nullptr};
  are_absent_ = true;
  EXPECT_FALSE(session_->EndWork(*operation, result)) << "it is to come again";
  EXPECT_FALSE(operation->HasEnded()) << "the next process would go on with it";
  are_absent_ = false;
  EXPECT_TRUE(session_->EndWork(*operation, result));
  EXPECT_EQ(operation->Describe().state(), v1::Operation::STATE_FAILED);
  StartProcess();
  EXPECT_EQ(resumed_, nullptr);
}

TEST_F(RestoredSessionTest, AnOperationThatOnlyWaitedIsNoSuspect) {
  const std::string name = StartOperation()->name();
  for (int i = 0; i < 5; ++i) {
    StartProcess();
    ASSERT_NE(resumed_, nullptr);
    EXPECT_EQ(resumed_->name(), name);
    EXPECT_FALSE(resumed_->IsSuspect());
  }
}

TEST_F(RestoredSessionTest, AParkedOperationIsNoSuspect) {
  StartOperation();
  for (int i = 0; i < 5; ++i) {
    const std::shared_ptr<Operation> operation = session_->ListOperations(0, 1).front();
    std::optional<SessionWork> work = session_->BeginWork(*operation);
    ASSERT_TRUE(work.has_value());
    WorkResult result{.status = absl::CancelledError("the server stops"), .work = *std::move(work), .mesh = nullptr};
    EXPECT_TRUE(session_->EndWork(*operation, result));
    EXPECT_FALSE(operation->HasEnded()) << "it is the next process's";
    StartProcess();
    ASSERT_NE(resumed_, nullptr);
    EXPECT_FALSE(resumed_->IsSuspect());
  }
}

TEST_F(RestoredSessionTest, ACancelThatWasNotedEndsTheOperation) {
  const std::shared_ptr<Operation> operation = StartOperation();
  ASSERT_TRUE(session_->BeginWork(*operation).has_value());
  EXPECT_TRUE(session_->Cancel(*operation).ok());
  EXPECT_FALSE(operation->HasEnded()) << "its work goes on until it hears of it";
  StartProcess();
  EXPECT_EQ(resumed_, nullptr);
  EXPECT_EQ(session_->ListOperations(0, 1).front()->Describe().state(), v1::Operation::STATE_CANCELLED);
}

TEST_F(RestoredSessionTest, PointsThatWereNotCommittedAreGone) {
  ASSERT_TRUE(session_->Append(0, std::vector<double>{0, 0, 1, 0}, 0).ok());
  EXPECT_EQ(session_->Describe().committed_points(), 0u);
  EXPECT_EQ(session_->Describe().revision(), 1u);
  ASSERT_TRUE(session_->CommitPoints().ok());
  EXPECT_EQ(session_->Describe().committed_points(), 2u);
  EXPECT_EQ(session_->Describe().revision(), 2u);
  ASSERT_TRUE(session_->Append(2, std::vector<double>{0.5, 1}, 0).ok());
  EXPECT_EQ(session_->UncommittedBytes(), 16u);
  StartProcess();
  EXPECT_EQ(session_->Describe().committed_points(), 2u);
  EXPECT_EQ(DetailsOf(session_->Append(3, std::vector<double>{0.5, 1}, 0)).reason, "UPLOAD_GAP");
  EXPECT_TRUE(session_->Append(1, std::vector<double>{1, 0, 7, 7}, 0).ok());
  ASSERT_TRUE(session_->CommitPoints().ok());
  StartProcess();
  EXPECT_EQ(session_->Describe().committed_points(), 3u);
  EXPECT_EQ(session_->inputs().points->Copy(4, 6, core::RunContext()).value(), std::vector<double>({7, 7}));
}

TEST_F(RestoredSessionTest, PointsAreCommittedWhileVerticesAreAdded) {
  Event begun;
  Event may_end;
  std::atomic<bool> is_adding = false;
  script_ = ScriptedMesher([&](core::Phase, core::RunContext&) {
    if (is_adding) {
      begun.Set();
      EXPECT_TRUE(may_end.Wait());
    }
    return absl::OkStatus();
  });
  ASSERT_TRUE(session_->Append(0, std::vector<double>{0, 0, 1, 0}, 0).ok());
  Refine();
  const std::vector<double> inside = {session_->meshes().last()->record().domain_low()[0],
                                      session_->meshes().last()->record().domain_low()[1]};
  ASSERT_TRUE(session_->Append(2, inside, 0).ok());
  is_adding = true;
  absl::StatusOr<AddedVertices> added;
  std::thread adding([&] {
    core::RunContext context;
    added = session_->AddVertices(inside, {}, 0, context);
  });
  ASSERT_TRUE(begun.Wait());
  EXPECT_TRUE(session_->CommitPoints().ok());
  EXPECT_EQ(session_->Describe().committed_points(), 3u) << "an upload that ends is told of all its points";
  may_end.Set();
  adding.join();
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(session_->Describe().committed_points(), 4u);
  const uint64_t revision = session_->Describe().revision();
  EXPECT_EQ(added->revision, revision);
  StartProcess();
  EXPECT_EQ(session_->Describe().committed_points(), 4u);
  EXPECT_EQ(session_->Describe().revision(), revision);
  EXPECT_EQ(session_->state()->steps.points(), 4u);
}

TEST_F(RestoredSessionTest, ASessionWhoseExpiryWasNotWrittenDownIsWhole) {
  ASSERT_TRUE(session_->Append(0, std::vector<double>{0, 0, 1, 0}, 0).ok());
  Refine();
  since_boot_ += absl::Hours(1);
  EXPECT_EQ(registry_->RemoveExpired().size(), 1u);
  StartProcess();
  EXPECT_TRUE(session_->meshes().last()->Metadata(true).ok()) << session_->meshes().last()->Metadata(true).status();
}

TEST_F(RestoredSessionTest, AnOperationTakesAllPointsThatWereAppended) {
  ASSERT_TRUE(session_->Append(0, std::vector<double>{0, 0, 1, 0}, 0).ok());
  StartOperation();
  StartProcess();
  EXPECT_NE(resumed_, nullptr);
  EXPECT_EQ(session_->Describe().committed_points(), 2u);
}

TEST_F(RestoredSessionTest, LimitsThatWereLoweredLoseNothing) {
  ASSERT_TRUE(session_->Append(0, std::vector<double>(20, 0.5), 0).ok());
  ASSERT_TRUE(session_->CommitPoints().ok());
  options_.max_points = 1;
  options_.max_points_per_tenant = 1;
  options_.max_sessions = 0;
  StartProcess();
  EXPECT_EQ(session_->Describe().committed_points(), 10u);
  EXPECT_EQ(DetailsOf(session_->Append(10, std::vector<double>{1, 2}, 0)).reason, "TOO_MANY_POINTS");
}

TEST_F(RestoredSessionTest, AClosedSessionIsNotTakenForADamagedOne) {
  const auto sizes = std::make_shared<const core::SizeSamples>(core::SizeSamples{.points = {0, 0}, .sizes = {1}});
  ASSERT_TRUE(session_->SetSizes(sizes, 0).ok());
  StartProcess();
  ASSERT_TRUE(session_->Close(0).ok());
  EXPECT_EQ(DetailsOf(session_->SetSizes(sizes, 0)).reason, "SESSION_NOT_FOUND") << "its sizes were not read yet";
}

// Records in which other calls come when a session is gone from the disk, and its deletion has not returned yet.
class AmidDeletion final : public PassingRecords {
 public:
  using PassingRecords::PassingRecords;

  absl::Status Apply(const SessionChange& change, Survives survives) override {
    const absl::Status status = PassingRecords::Apply(change, survives);
    if (change.is_deletion) {
      others();
    }
    return status;
  }

  std::function<void()> others;
};

TEST_F(RestoredSessionTest, WhatComesBesideADeletionFindsNoDamage) {
  auto amid = std::make_unique<AmidDeletion>(log_);
  AmidDeletion& records = *amid;
  SessionLog log(std::move(amid), std::make_unique<PassingFiles>(log_));
  SessionRegistry registry(options_, memory_, Clock(), log);
  const std::shared_ptr<Session> session =
      registry.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = absl::Hours(1)}).value();
  const std::vector<double> points = {0, 0, 1, 0};
  ASSERT_TRUE(session->Append(0, points, 0).ok());
  ASSERT_TRUE(session->CommitPoints().ok());
  records.others = [&] {
    EXPECT_TRUE(session->Append(2, std::vector<double>{0.5, 1}, 0).ok()) << "an upload that goes on";
    EXPECT_TRUE(session->Append(0, points, 0).ok()) << "one that begins again";
    EXPECT_TRUE(session->CheckPrefix({.first = 0, .end = 2, .crc32c = Crc32c(points.data(), 32)}).ok());
    EXPECT_EQ(session->inputs().points->Copy(0, 4, core::RunContext()).value(), points) << "a refinement";
  };
  ASSERT_TRUE(session->Close(0).ok());
  EXPECT_EQ(DetailsOf(session->Append(3, points, 0)).reason, "SESSION_NOT_FOUND");
  EXPECT_EQ(DetailsOf(session->CheckPrefix({.first = 0, .end = 2})).reason, "SESSION_NOT_FOUND");
  EXPECT_TRUE(session->CommitPoints().ok()) << "nothing is left to be committed";
}

TEST_F(RestoredSessionTest, AClosedSessionIsWrittenDownNoMore) {
  const std::shared_ptr<Operation> operation = StartOperation();
  std::optional<SessionWork> work = session_->BeginWork(*operation);
  ASSERT_TRUE(session_->Close(0).ok());
  WorkResult result{.status = absl::CancelledError("deleted"), .work = *std::move(work), .mesh = nullptr};
  EXPECT_TRUE(session_->EndWork(*operation, result));
  const std::string name = session_->name();
  session_ = nullptr;
  StartProcess();
  EXPECT_FALSE(registry_->Find("a", name).ok());
}

}  // namespace
}  // namespace wellspace::server
