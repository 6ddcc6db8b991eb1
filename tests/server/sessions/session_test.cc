// The operations of a session, without a worker.
#include "server/sessions/session.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "server/jobs/job_pool.h"
#include "server/sessions/session_registry.h"
#include "server/store/memory_files.h"
#include "server/store/memory_records.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

class SessionTest : public ::testing::Test {
 protected:
  std::shared_ptr<Operation> Start() {
    absl::StatusOr<std::shared_ptr<Operation>> operation = TryToStart(absl::OkStatus());
    EXPECT_TRUE(operation.ok()) << operation.status();
    return operation.value_or(nullptr);
  }

  // Starts an operation, where the queue of jobs answers with `submitted`.
  absl::StatusOr<std::shared_ptr<Operation>> TryToStart(const absl::Status& submitted) {
    return session_->StartOperation({.dimension = 2}, /*restart=*/false, 0,
                                    [submitted](const std::shared_ptr<Operation>& /*operation*/) { return submitted; });
  }

  // The session as a client sees it, its time of expiry excepted.
  std::string Seen() const {
    v1::Session message = session_->Describe();
    message.clear_expire_time();
    return message.DebugString();
  }

  std::vector<std::string> Operations() const {
    std::vector<std::string> names;
    for (const std::shared_ptr<Operation>& operation : session_->ListOperations(0, 1000)) {
      names.push_back(operation->name());
    }
    return names;
  }

  const absl::Status refusal_ = MakeError(v1::ERROR_REASON_QUEUE_FULL, "full");
  ServiceOptions options_;
  MemoryBudget memory_{0};
  const std::unique_ptr<SessionLog> log_ = MakeEphemeralLog();
  SessionRegistry registry_{options_, memory_, {}, *log_};
  std::shared_ptr<Session> session_ =
      registry_.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = {}}).value();
};

TEST_F(SessionTest, AnOperationHasTheSessionToItself) {
  const std::shared_ptr<Operation> operation = Start();
  EXPECT_EQ(DetailsOf(TryToStart(absl::OkStatus()).status()).reason, "SESSION_BUSY");
  EXPECT_EQ(DetailsOf(session_->Append(0, std::vector<double>{0.5, 0.5}, 0)).reason, "SESSION_BUSY");
  EXPECT_TRUE(session_->Cancel(*operation).ok());
  EXPECT_TRUE(session_->Cancel(*operation).ok()) << "it has ended";
  EXPECT_EQ(operation->Describe().state(), v1::Operation::STATE_CANCELLED);
  EXPECT_NE(Start(), nullptr);
}

TEST_F(SessionTest, AnOperationWhoseWorkIsRefusedLeavesTheSessionAsItWas) {
  EXPECT_TRUE(session_->Cancel(*Start()).ok());
  const std::string seen = Seen();
  const std::vector<std::string> operations = Operations();
  EXPECT_EQ(TryToStart(refusal_).status(), refusal_);
  EXPECT_EQ(Seen(), seen);
  EXPECT_EQ(Operations(), operations);
  EXPECT_TRUE(session_->Append(0, std::vector<double>{0.5, 0.5}, 0).ok());
  EXPECT_EQ(Start()->number(), 2u) << "its number is given again";
}

TEST_F(SessionTest, AnOperationWhoseWorkIsRefusedDisplacesNoOther) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(session_->Cancel(*Start()).ok());
  }
  const std::vector<std::string> operations = Operations();
  EXPECT_FALSE(TryToStart(refusal_).ok());
  EXPECT_EQ(Operations(), operations);
  EXPECT_TRUE(session_->Cancel(*Start()).ok());
  EXPECT_EQ(Operations().size(), 100u);
  EXPECT_EQ(Operations().front(), operations[1]);
}

TEST_F(SessionTest, WhileItsWorkIsSubmittedTheSessionIsBusyAndDoesNotShowTheOperation) {
  const std::string before = Seen();
  EXPECT_TRUE(session_
                  ->StartOperation({.dimension = 2}, /*restart=*/false, 0,
                                   [&](const std::shared_ptr<Operation>& operation) {
                                     EXPECT_EQ(Seen(), before);
                                     EXPECT_TRUE(Operations().empty());
                                     EXPECT_TRUE(operation->IsQueued());
                                     const absl::Status busy = session_->Append(0, std::vector<double>{0.5, 0.5}, 0);
                                     EXPECT_EQ(DetailsOf(busy).reason, "SESSION_BUSY");
                                     return absl::OkStatus();
                                   })
                  .ok());
}

TEST_F(SessionTest, ChangesThatNeedNoIdleSessionAreMadeWhileWorkIsSubmitted) {
  const auto submit = [&](const std::shared_ptr<Operation>& /*operation*/) {
    return session_->Update(std::map<std::string, std::string>{{"key", "value"}}, std::nullopt, 0);
  };
  const auto operation = session_->StartOperation({.dimension = 2}, /*restart=*/false, 0, submit);
  ASSERT_TRUE(operation.ok()) << operation.status();
  EXPECT_EQ(session_->Describe().labels().at("key"), "value");
  EXPECT_EQ(session_->Describe().state(), v1::Session::STATE_REFINING);
}

TEST_F(SessionTest, ASessionThatIsDeletedWhileWorkIsSubmittedRefusesTheStart) {
  std::shared_ptr<Operation> submitted;
  const auto submit = [&](const std::shared_ptr<Operation>& operation) {
    submitted = operation;
    const auto under_way = session_->Close(0);
    EXPECT_TRUE(under_way.ok()) << under_way.status();
    EXPECT_EQ(under_way.value(), nullptr) << "nothing is under way yet";
    return absl::OkStatus();
  };
  const auto operation = session_->StartOperation({.dimension = 2}, /*restart=*/false, 0, submit);
  EXPECT_EQ(DetailsOf(operation.status()).reason, "SESSION_NOT_FOUND");
  EXPECT_FALSE(session_->BeginWork(*submitted).has_value());
}

TEST_F(SessionTest, AWorkerThatIsFasterWaitsForTheStart) {
  std::thread worker;
  std::optional<SessionWork> work;
  v1::Session::State seen = v1::Session::STATE_UNSPECIFIED;
  const auto submit = [&](const std::shared_ptr<Operation>& operation) {
    worker = std::thread([&, operation] {
      work = session_->BeginWork(*operation);
      seen = session_->Describe().state();
    });
    return absl::OkStatus();
  };
  const auto operation = session_->StartOperation({.dimension = 2}, /*restart=*/false, 0, submit);
  worker.join();
  EXPECT_TRUE(work.has_value());
  EXPECT_EQ(seen, v1::Session::STATE_REFINING);
  EXPECT_FALSE((*operation)->IsQueued());
}

TEST_F(SessionTest, AnOperationThatHasEndedTakesNoJob) {
  MemoryBudget memory(0);
  JobPool pool({.workers = 1, .max_queued = 1, .max_per_tenant = 2}, memory);
  const std::shared_ptr<Job> job = pool.Submit({.tenant = "a", .work = [](Job&) {}}).value();
  const std::shared_ptr<Operation> operation = Start();
  EXPECT_TRUE(operation->SetJob(job));
  EXPECT_EQ(operation->job(), job);
  EXPECT_TRUE(session_->Cancel(*operation).ok());
  EXPECT_EQ(operation->job(), nullptr);
  EXPECT_FALSE(operation->SetJob(job)) << "the caller has to cancel it";
  EXPECT_EQ(operation->job(), nullptr);
  EXPECT_FALSE(session_->BeginWork(*operation).has_value());
}

// A log in memory, with records or files of the test's.
template <typename R = MemoryRecords, typename F = MemoryFiles>
struct TestLog {
  R* const records = new R;
  F* const files = new F;
  SessionLog log{std::unique_ptr<Records>(records), std::unique_ptr<Files>(files)};
};

// Records that have no room while `is_full`.
class RecordsOnAFullDisk : public MemoryRecords {
 public:
  bool is_durable() const override { return true; }
  absl::Status Apply(const SessionChange& /*change*/, Survives /*survives*/) override {
    return is_full ? MakeError(v1::ERROR_REASON_DISK_FULL, "full") : absl::OkStatus();
  }

  bool is_full = false;
};

TEST(SessionOnAFullDisk, AWorkerThatIsFasterThanARefusedStartDoesNotBegin) {
  const ServiceOptions options;
  MemoryBudget memory(uint64_t{1} << 30);
  TestLog<RecordsOnAFullDisk> log;
  SessionRegistry registry(options, memory, {}, log.log);
  const std::shared_ptr<Session> session =
      registry.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = {}}).value();
  log.records->is_full = true;
  std::thread worker;
  bool has_begun = true;
  const auto submit = [&](const std::shared_ptr<Operation>& operation) {
    worker = std::thread([&, operation] { has_begun = session->BeginWork(*operation).has_value(); });
    return absl::OkStatus();
  };
  const auto operation = session->StartOperation({.dimension = 2}, /*restart=*/false, 0, submit);
  worker.join();
  EXPECT_EQ(DetailsOf(operation.status()).reason, "DISK_FULL");
  EXPECT_FALSE(has_begun);
  log.records->is_full = false;
  EXPECT_TRUE(session->StartOperation({.dimension = 2}, false, 0, [](const auto&) { return absl::OkStatus(); }).ok());
}

TEST(SessionOnAFullDisk, ChangesAreRefusedAndNoneIsMade) {
  const ServiceOptions options;
  MemoryBudget memory(uint64_t{1} << 30);
  TestLog<RecordsOnAFullDisk> log;
  SessionRegistry registry(options, memory, {}, log.log);
  const std::shared_ptr<Session> session =
      registry.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = {}}).value();
  const auto sizes = std::make_shared<const core::SizeSamples>(core::SizeSamples{.points = {0, 0}, .sizes = {1}});
  ASSERT_TRUE(session->SetSizes(sizes, 0).ok());
  log.records->is_full = true;
  memory.NoteIdle();  // as far as it knows, a session may give up memory: that is no help with a disk
  v1::Session before = session->Describe();
  EXPECT_EQ(DetailsOf(session->SetSizes(nullptr, 0)).reason, "DISK_FULL");
  FeaturePart part;
  part.mutable_segments()->add_ends(0);
  part.mutable_segments()->add_ends(1);
  EXPECT_EQ(DetailsOf(session->AddFeatures(part, {}, 0)).reason, "DISK_FULL");
  ASSERT_TRUE(session->Append(0, std::vector<double>{0.5, 0.5}, 0).ok());
  EXPECT_EQ(DetailsOf(session->CommitPoints()).reason, "DISK_FULL");
  EXPECT_TRUE(memory.CanMakeRoom()) << "nothing was given up for it";
  v1::Session after = session->Describe();
  before.clear_expire_time();
  after.clear_expire_time();
  EXPECT_EQ(after.DebugString(), before.DebugString());
  log.records->is_full = false;
  EXPECT_TRUE(session->SetSizes(nullptr, 0).ok());
  EXPECT_EQ(session->Describe().size_count(), 0u);
}

// Records whose changes find no memory while `is_out_of_memory`.
class RecordsWithoutMemory final : public MemoryRecords {
 public:
  bool is_durable() const override { return true; }
  absl::Status Apply(const SessionChange& /*change*/, Survives /*survives*/) override {
    if (is_out_of_memory) {
      throw std::bad_alloc();
    }
    return absl::OkStatus();
  }

  bool is_out_of_memory = false;
};

TEST(SessionOutOfMemory, AStartAndAnUploadAreRefusedAndMayBeTriedAgain) {
  const ServiceOptions options;
  MemoryBudget memory(uint64_t{1} << 30);
  TestLog<RecordsWithoutMemory> log;
  SessionRegistry registry(options, memory, {}, log.log);
  const std::shared_ptr<Session> session =
      registry.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = {}}).value();
  ASSERT_TRUE(session->Append(0, std::vector<double>{0.5, 0.5}, 0).ok());
  log.records->is_out_of_memory = true;
  EXPECT_EQ(DetailsOf(session->CommitPoints()).reason, "OUT_OF_MEMORY");
  EXPECT_EQ(session->UncommittedBytes(), 0u) << "no point is left without its checksum";
  const auto submit = [](const auto&) { return absl::OkStatus(); };
  const auto refused = session->StartOperation({.dimension = 2}, /*restart=*/false, 0, submit);
  EXPECT_EQ(DetailsOf(refused.status()).reason, "OUT_OF_MEMORY");
  EXPECT_NE(session->Describe().state(), v1::Session::STATE_REFINING);
  log.records->is_out_of_memory = false;
  ASSERT_TRUE(session->Append(0, std::vector<double>{0.5, 0.5}, 0).ok());
  EXPECT_TRUE(session->CommitPoints().ok());
  EXPECT_TRUE(session->StartOperation({.dimension = 2}, false, 0, submit).ok());
}

// Files that tell when points are about to be copied to a file of their own.
class FilesThatTellOfRemovals final : public MemoryFiles {
 public:
  std::unique_ptr<PointStore> OpenPoints(SessionPoints points) override {
    if (points.next.number() > 1) {
      on_removal();
    }
    return MemoryFiles::OpenPoints(std::move(points));
  }

  std::function<void()> on_removal;
};

TEST(SessionRemoval, WhatIsAppendedIsCommittedWithTheRemoval) {
  const ServiceOptions options;
  MemoryBudget memory(uint64_t{1} << 30);
  TestLog<RecordsOnAFullDisk, FilesThatTellOfRemovals> log;
  SessionRegistry registry(options, memory, {}, log.log);
  const std::shared_ptr<Session> session =
      registry.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = {}}).value();
  ASSERT_TRUE(session->Append(0, std::vector<double>{0, 0, 1, 0, 0, 1}, 0).ok());
  ASSERT_TRUE(session->CommitPoints().ok());
  ASSERT_TRUE(session->Append(3, std::vector<double>{1, 1}, 0).ok());
  const uint64_t revision = session->Describe().revision();
  bool is_told = false;
  log.files->on_removal = [&] {
    is_told = true;
    EXPECT_TRUE(session->CommitPoints().ok()) << "an upload that ends now";
    EXPECT_EQ(session->state()->record.points(), 3u) << "points that are being copied stay what they are";
    EXPECT_EQ(DetailsOf(session->Append(4, std::vector<double>{2, 2}, 0)).reason, "SESSION_BUSY");
  };
  const absl::StatusOr<PointsLeft> left = session->RemovePoints(std::vector<uint64_t>{1}, 0);
  ASSERT_TRUE(left.ok()) << left.status();
  EXPECT_TRUE(is_told);
  EXPECT_EQ(left->points, 3u);
  EXPECT_EQ(left->revision, revision + 1);
  EXPECT_EQ(session->state()->record.points(), 3u);
  EXPECT_EQ(session->state()->record.revision(), left->revision);
}

TEST(SessionOnAFullDisk, OperationsOfAnEarlierProcessAreTakenUp) {
  const ServiceOptions options;
  MemoryBudget memory(uint64_t{1} << 30);
  TestLog<RecordsOnAFullDisk> log;
  log.records->is_full = true;
  StoredSession stored;
  stored.state.set_name("sessions/1");
  stored.state.set_revision(1);
  stored.state.set_next_operation(2);
  *stored.state.mutable_parameters() = ParametersToProto({.dimension = 2});
  store::v1::OperationRecord& waiting = stored.operations.emplace_back();
  waiting.set_number(1);
  waiting.set_attempts(1);
  waiting.set_state(v1::Operation::STATE_QUEUED);
  *waiting.mutable_parameters() = stored.state.parameters();
  const auto resume = [&](const std::shared_ptr<Session>& session) {
    const absl::StatusOr<std::shared_ptr<Operation>> resumed = session->ResumeOperation();
    EXPECT_TRUE(resumed.ok()) << "the server would not start: " << resumed.status();
    return resumed.value_or(nullptr);
  };
  const auto restore = [&] {
    return Session::Restore(stored, options, memory, {}, std::make_shared<TenantPoints>(), log.log).value();
  };
  const std::shared_ptr<Session> session = restore();
  const std::shared_ptr<Operation> resumed = resume(session);
  ASSERT_NE(resumed, nullptr);
  EXPECT_TRUE(resumed->IsQueued());

  waiting.set_crashes(2);
  waiting.set_state(v1::Operation::STATE_RUNNING);
  const std::shared_ptr<Session> crashed = restore();
  EXPECT_EQ(resume(crashed), nullptr);
  EXPECT_EQ(crashed->FindOperation("sessions/1/operations/1").value()->Describe().state(), v1::Operation::STATE_FAILED);
}

}  // namespace
}  // namespace wellspace::server
