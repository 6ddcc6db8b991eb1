// Each operation of a life fails once: with a full disk nothing is changed and all goes on; with a broken one the log
// says so once, and acknowledges nothing more. Acknowledged changes are there in any case.
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "tests/server/store/simulated_disk.h"
#include "tests/server/store/store_life.h"
#include "tests/support/clouds.h"

namespace wellspace::server {
namespace {

using Action = StoreLife::Action;
using Fault = SimulatedDisk::Fault;
using Loss = SimulatedDisk::Loss;

const std::vector<std::pair<Action, uint64_t>>& Script() {
  static const std::vector<std::pair<Action, uint64_t>> script = {
      {Action::kCreate, 0},      {Action::kUpload, 0},   {Action::kStart, 0},   {Action::kSucceed, 0},
      {Action::kCreate, 1},      {Action::kUpload, 0},   {Action::kTouch, 0},   {Action::kUpload, 1},
      {Action::kAddFeatures, 1}, {Action::kSetSizes, 1}, {Action::kSucceed, 0}, {Action::kForget, 0},
      {Action::kUpdate, 1},      {Action::kSucceed, 1},  {Action::kDelete, 0},  {Action::kSweep, 0},
      {Action::kUpload, 1},
  };
  return script;
}

// The life in which `count` operations from `operation` on fail. False: the life was over before.
bool LiveWithFault(SimulatedDisk& disk, uint64_t operation, Fault fault, uint64_t count, Loss loss) {
  disk.Clear();
  disk.CountReads();
  disk.FailAt(operation, fault, count);
  StoreLife life(disk);
  absl::Status opened = life.Open();
  for (int attempt = 0; !opened.ok() && attempt < 200; ++attempt) {
    EXPECT_THAT(std::string(opened.message()), ::testing::StartsWith("/")) << "names a file";
    opened = life.Open();
  }
  EXPECT_TRUE(opened.ok()) << "at " << disk.failed_operation() << ": " << opened;
  const auto where = [&] { return absl::StrCat("operation ", operation, ", ", disk.failed_operation()); };
  for (const auto& [action, number] : Script()) {
    const bool has_failed = life.failures() > 0;
    const int acknowledgments = life.acknowledgments();
    const absl::Status status = life.Do(action, number);
    if (has_failed) {
      EXPECT_EQ(life.acknowledgments(), acknowledgments) << where() << ": acknowledged after a failure";
      EXPECT_TRUE(status.ok() || action == Action::kSweep || ReasonOf(status) == "STORE_FAILED") << where() << status;
    }
    if (status.code() == absl::StatusCode::kUnavailable && action != Action::kSweep) {
      EXPECT_EQ(life.failures(), 1) << where() << ": " << status;
    }
    if (count == 1 && fault != Fault::kBroken && !status.ok() && disk.failed_operation().starts_with("write ")) {
      EXPECT_TRUE(ReasonOf(status) == "DISK_FULL") << where() << ": " << status;
    }
  }
  EXPECT_LE(life.failures(), 1) << where();
  const bool is_within = disk.operations() > operation;
  const std::string at = where();
  disk.FailAt(0, fault, 0);
  if (life.failures() == 0) {
    const std::string problem = life.Check();
    EXPECT_TRUE(problem.empty()) << at << ": " << problem.substr(0, 9000);
  }
  test::SplitMix64 random(operation);
  const std::string problem = life.Restart(loss, random);
  EXPECT_TRUE(problem.empty()) << at << ": " << problem.substr(0, 9000);
  return is_within;
}

class StoreFaults : public ::testing::TestWithParam<std::tuple<Fault, uint64_t>> {};

TEST_P(StoreFaults, LoseNothingWhereverTheyAre) {
  const auto [fault, count] = GetParam();
  SimulatedDisk disk;
  uint64_t operation = 0;
  while (LiveWithFault(disk, operation, fault, count, operation % 2 == 0 ? Loss::kProcess : Loss::kSome) &&
         !HasFailure()) {
    ++operation;
  }
  EXPECT_GT(operation, 200u);
}

INSTANTIATE_TEST_SUITE_P(All, StoreFaults,
                         ::testing::Combine(::testing::Values(Fault::kNoSpace, Fault::kBroken, Fault::kShortWrite),
                                            ::testing::Values(1u, 7u)));

// A disk that is full for a while takes nothing, and then goes on.
TEST(StoreFaults, AFullDiskPasses) {
  SimulatedDisk disk;
  StoreLife life(disk);
  ASSERT_TRUE(life.Open().ok());
  ASSERT_TRUE(life.Do(Action::kCreate, 0).ok());
  ASSERT_TRUE(life.Do(Action::kUpload, 0).ok());
  // Writes of the database, of points and of meshes all come first in their kind.
  for (const Action action : {Action::kUpdate, Action::kUpload, Action::kSucceed, Action::kDelete}) {
    disk.FailAt(disk.operations(), Fault::kNoRoom, 1'000'000);
    const absl::Status status = life.Do(action, 0);
    EXPECT_EQ(ReasonOf(status), "DISK_FULL") << static_cast<int>(action);
    EXPECT_EQ(life.Check(), "");
  }
  disk.FailAt(0, Fault::kNoRoom, 0);
  EXPECT_EQ(life.failures(), 0);
  for (const Action action : {Action::kUpdate, Action::kUpload, Action::kSucceed, Action::kDelete}) {
    EXPECT_TRUE(life.Do(action, 0).ok());
  }
  EXPECT_EQ(life.Check(), "");
}

// A file whose permission is missing is as it was: it is not called damaged, nor does the server end for it.
TEST(StoreFaults, AFileThatMayNotBeOpenedIsNotDamaged) {
  SimulatedDisk disk;
  disk.CountReads();
  StoreLife life(disk);
  ASSERT_TRUE(life.Open().ok());
  for (const Action action : {Action::kCreate, Action::kUpload, Action::kSucceed, Action::kSucceed}) {
    ASSERT_TRUE(life.Do(action, 0).ok());
  }
  const LifeState::Session session = life.state().sessions.at(0);
  ASSERT_TRUE(session.mesh.has_value());
  const std::vector<store::v1::PointsFile> files = PointsFilesOf(session.state);
  const auto points = life.log()->files().OpenPoints({.session = session.state.name(),
                                                      .dimension = 3,
                                                      .files = files,
                                                      .committed = {session.steps.at(0).points()},
                                                      .next = files.back()});
  const auto mesh = life.log()->files().FindMesh(session.state);
  disk.FailAt(disk.operations(), Fault::kForbidden, 1'000'000);
  for (const absl::Status& status :
       {points->CopyFrom(0, core::RunContext()).status(), points->Append(std::vector<double>{1, 2, 3}),
        mesh->Load(core::RunContext()).status(), life.Do(Action::kUpload, 0), life.Do(Action::kSucceed, 0)}) {
    EXPECT_EQ(ReasonOf(status), "STORE_FAILED") << status;
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("Permission denied; the user that the server"));
  }
  EXPECT_EQ(life.failures(), 0);
  disk.FailAt(0, Fault::kForbidden, 0);
  EXPECT_TRUE(life.Do(Action::kUpload, 0).ok());
  EXPECT_EQ(life.Check(), "");
}

// The kind of data that tenants have filled the disk with.
enum class Filling { kPoints, kMeshes, kRows };

// One session more, with its data.
absl::Status FillOnce(SessionLog& log, Filling filling, uint64_t number) {
  SessionChange change{
      .session = SessionName(number), .state = MakeState(number), .answer = MakeAnswer("a", absl::StrCat(number), "c")};
  if (absl::Status status = CommitTo(log, change); !status.ok()) {
    return status;
  }
  change.answer.reset();
  if (filling == Filling::kPoints) {
    const std::unique_ptr<PointStore> points = log.files().OpenPoints({.session = change.session, .dimension = 3});
    const std::vector<double> coordinates(3000, static_cast<double>(number));
    if (absl::Status status = points->Append(coordinates); !status.ok()) {
      return status;
    }
    change.steps = {MakePointsStep(0, coordinates, 3)};
    change.state->set_points(1000);
    return points->Synchronize().ok() ? CommitTo(log, change) : absl::InternalError("not synchronised");
  }
  if (filling == Filling::kMeshes) {
    const auto mesh =
        log.files().KeepMesh(change.session, 1, /*epoch=*/0, MakeMesh({.vertices = 500}), core::RunContext());
    if (!mesh.ok()) {
      return mesh.status();
    }
    *change.state->mutable_mesh() = (*mesh)->record();
    return CommitTo(log, change);
  }
  change.sizes = StoredSizes{.number = 1, .parts = {}};
  store::v1::SizesRecord& part = change.sizes->parts.emplace_back();
  for (int i = 0; i < 2000; ++i) {
    part.mutable_samples()->add_sizes(i + static_cast<double>(number));
  }
  return CommitTo(log, change);
}

// Deletions find room on a full disk, however it came to be full, also after a start; and then all goes on.
TEST(StoreFaults, AFullDiskIsEmptiedByThoseWhoFilledIt) {
  for (const Filling filling : {Filling::kPoints, Filling::kMeshes, Filling::kRows}) {
    for (const bool starts_again : {false, true}) {
      const std::string where = absl::StrCat(static_cast<int>(filling), starts_again ? ", after a start" : "");
      SimulatedDisk disk;
      const DurableLogOptions options = {.folder = "/data",
                                         .files = &disk.files(),
                                         .ballast_bytes = 256 << 10,
                                         .tables = {.vfs = disk.vfs(), .is_exclusive = true}};
      absl::StatusOr<std::unique_ptr<SessionLog>> log = OpenDurableLog(options);
      ASSERT_TRUE(log.ok()) << log.status();
      EXPECT_GE(disk.UsedBytes(), options.ballast_bytes);
      disk.LimitBytes(disk.UsedBytes() + (1 << 20));
      uint64_t sessions = 0;
      // All kinds at the end, as small as they are: no room is left for any.
      for (int refused = 0; refused < 20; ++sessions) {
        const absl::Status status = FillOnce(**log, filling, sessions);
        ASSERT_TRUE(status.ok() || ReasonOf(status) == "DISK_FULL") << where << status;
        refused += status.ok() ? 0 : 1;
        ASSERT_LT(sessions, 1000u);
      }
      EXPECT_EQ(ReasonOf(FillOnce(**log, filling, sessions)), "DISK_FULL") << where;
      if (starts_again) {
        disk.DieAt(disk.operations());
        log->reset();
        disk.Restart(Loss::kProcess, 1);
        log = OpenDurableLog(options);
        ASSERT_TRUE(log.ok()) << where << log.status();
      }
      const StoredSessions stored = *(*log)->records().Load();
      for (const StoredSession& session : stored.sessions) {
        SessionChange deletion{.session = session.state.name(), .is_deletion = true};
        deletion.answer = MakeAnswer("tenant", session.state.name(), "deleted");
        const absl::Status deleted = CommitTo(**log, deletion);
        ASSERT_TRUE(deleted.ok()) << where << ", " << session.state.name() << ": " << deleted;
      }
      EXPECT_TRUE((*log)->records().Load()->sessions.empty()) << where;
      for (uint64_t number = 1000; number < 1010; ++number) {
        const absl::Status again = FillOnce(**log, filling, number);
        EXPECT_TRUE(again.ok()) << where << again;
      }
    }
  }
}

// However little room a start has, it takes everything over at once, in the room of the ballast if need be, and not
// only with its first change: the next process finds the epoch of this one.
TEST(StoreFaults, AStartHasTheRoomOfTheBallast) {
  constexpr uint64_t kBallast = 256 << 10;
  constexpr uint64_t kPage = 4096;
  SimulatedDisk disk;
  const DurableLogOptions options = {.folder = "/data",
                                     .files = &disk.files(),
                                     .ballast_bytes = kBallast,
                                     .tables = {.vfs = disk.vfs(), .is_exclusive = true}};
  int given_up = 0;
  for (uint64_t less = 0; less < kBallast / 2; less += kPage) {
    disk.Clear();
    disk.LimitBytes(uint64_t{1} << 40);
    absl::StatusOr<std::unique_ptr<SessionLog>> log = OpenDurableLog(options);
    ASSERT_TRUE(log.ok()) << log.status();
    ASSERT_TRUE(CommitTo(**log, {.session = SessionName(1), .state = MakeState(1)}).ok());
    disk.DieAt(disk.operations());
    log->reset();
    disk.Restart(Loss::kProcess, 1);
    disk.LimitBytes(disk.UsedBytes() - less);
    log = OpenDurableLog(options);
    ASSERT_TRUE(log.ok()) << less << log.status();
    given_up += disk.SizeOf("/data/ballast") == 0 ? 1 : 0;
    const uint64_t epoch = (*log)->records().epoch();
    disk.DieAt(disk.operations());
    log->reset();
    disk.Restart(Loss::kProcess, 1);
    disk.LimitBytes(uint64_t{1} << 40);
    const absl::StatusOr<std::unique_ptr<SessionTables>> tables =
        SessionTables::Open("/data/sessions.db", options.tables);
    ASSERT_TRUE(tables.ok()) << tables.status();
    EXPECT_EQ((*tables)->Load()->sessions.at(0).epoch, epoch) << less;
  }
  EXPECT_GT(given_up, 0);
}

// After a synchronisation that failed nothing is tried again on the same file: it would succeed, and be wrong.
TEST(StoreFaults, AFailedSynchronisationIsFinal) {
  SimulatedDisk disk;
  for (const Action action : {Action::kUpdate, Action::kUpload, Action::kSucceed}) {
    bool is_found = false;
    for (uint64_t skip = 0; !is_found; ++skip) {
      disk.Clear();
      StoreLife life(disk);
      ASSERT_TRUE(life.Open().ok());
      ASSERT_TRUE(life.Do(Action::kCreate, 0).ok());
      ASSERT_TRUE(life.Do(Action::kUpload, 0).ok());
      disk.FailAt(disk.operations() + skip, Fault::kBroken);
      const absl::Status status = life.Do(action, 0);
      ASSERT_TRUE(disk.has_failed());
      is_found = disk.failed_operation().starts_with("synchronise ");
      if (is_found) {
        EXPECT_EQ(ReasonOf(status), "STORE_FAILED");
        EXPECT_EQ(life.failures(), 1);
        EXPECT_EQ(ReasonOf(life.Do(Action::kUpdate, 0)), "STORE_FAILED");
        EXPECT_EQ(ReasonOf(life.Do(Action::kUpload, 0)), "STORE_FAILED");
        EXPECT_EQ(ReasonOf(life.Do(Action::kSucceed, 0)), "STORE_FAILED");
        EXPECT_EQ(life.failures(), 1) << "said once";
        test::SplitMix64 random(skip);
        EXPECT_EQ(life.Restart(Loss::kAll, random), "");
      }
    }
  }
}

// The process ends since the disk could not be synchronised, and is started again at once. The kernel shows it what it
// has in memory, which no synchronisation writes any more; and then there is a loss of power.
TEST(StoreFaults, AStartWritesAgainWhatMayNotBeOnTheDisk) {
  SimulatedDisk disk;
  test::SplitMix64 random(1);
  for (uint64_t operation = 0; operation < 40; ++operation) {
    disk.Clear();
    StoreLife life(disk);
    ASSERT_TRUE(life.Open().ok());
    ASSERT_TRUE(life.Do(Action::kCreate, 0).ok());
    disk.FailAt(disk.operations() + operation, Fault::kBroken);
    for (const Action action : {Action::kUpdate, Action::kUpload, Action::kSucceed}) {
      life.Do(action, 0).IgnoreError();
    }
    ASSERT_EQ(life.Restart(Loss::kProcess, random), "") << disk.failed_operation();
    ASSERT_TRUE(life.Do(Action::kUpdate, 0).ok());
    ASSERT_TRUE(life.Do(Action::kTouch, 0).ok());
    ASSERT_EQ(life.Restart(Loss::kProcess, random), "") << disk.failed_operation();
    ASSERT_EQ(life.Restart(Loss::kAll, random), "") << disk.failed_operation();
  }
}

TEST(StoreFaults, AStartWithoutRoomReadsAndThenGoesOn) {
  SimulatedDisk disk;
  const DurableLogOptions options = {
      .folder = "/data", .files = &disk.files(), .tables = {.vfs = disk.vfs(), .is_exclusive = true}};
  absl::StatusOr<std::unique_ptr<SessionLog>> log = nullptr;
  // The second change is written and not synchronised, and the process ends.
  for (uint64_t skip = 0; !disk.failed_operation().starts_with("synchronise "); ++skip) {
    log->reset();
    disk.Clear();
    log = OpenDurableLog(options);
    ASSERT_TRUE(log.ok()) << log.status();
    ASSERT_TRUE(CommitTo(**log, {.session = SessionName(1), .state = MakeState(1)}).ok());
    disk.FailAt(disk.operations() + skip, Fault::kBroken);
    ASSERT_FALSE(CommitTo(**log, {.session = SessionName(1), .state = MakeState(1, 2)}).ok());
  }
  disk.DieAt(disk.operations());
  log->reset();
  disk.Restart(Loss::kProcess, 1);

  disk.FailAt(disk.operations(), Fault::kNoRoom, 1'000'000);
  log = OpenDurableLog(options);
  ASSERT_TRUE(log.ok()) << log.status();
  const absl::StatusOr<StoredSessions> loaded = (*log)->records().Load();
  ASSERT_EQ(loaded->sessions.size(), 1u);
  EXPECT_EQ(ReasonOf(CommitTo(**log, {.session = SessionName(2), .state = MakeState(2)})), "DISK_FULL");
  disk.FailAt(0, Fault::kNoRoom, 0);
  ASSERT_TRUE(CommitTo(**log, {.session = SessionName(2), .state = MakeState(2)}).ok());
  // As a session does that was loaded.
  SessionChange restored = {.session = SessionName(1), .epoch = loaded->sessions[0].epoch, .state = MakeState(1, 3)};
  EXPECT_TRUE((*log)->Commit(restored).ok());
  disk.DieAt(disk.operations());
  log->reset();
  disk.Restart(Loss::kAll, 1);
  log = OpenDurableLog(options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ((*log)->records().Load()->sessions.size(), 2u) << "acknowledged behind what may not have been on the disk";
}

// A write-ahead log that ends in the middle, or has other bytes: all before is there, or the start names the fault.
TEST(StoreFaults, AWriteAheadLogThatIsTornEndsThere) {
  SimulatedDisk disk;
  StoreLife life(disk);
  ASSERT_TRUE(life.Open().ok());
  ASSERT_TRUE(life.Do(Action::kCreate, 0).ok());
  ASSERT_TRUE(life.Do(Action::kCreate, 1).ok());
  const std::string wal = std::string(StoreLife::kFolder) + "/sessions.db-wal";
  const uint64_t size = disk.SizeOf(wal);
  ASSERT_TRUE(life.Do(Action::kTouch, 0).ok());
  ASSERT_GT(disk.SizeOf(wal), size);
  disk.Flip(wal, size + 2000, 3);  // of the last change, which was not synchronised
  test::SplitMix64 random(1);
  EXPECT_THAT(life.Restart(Loss::kProcess, random), ::testing::StartsWith("found is")) << "it is lost";
  EXPECT_EQ(life.log()->records().Load()->sessions.size(), 2u) << "and nothing else";
}

}  // namespace
}  // namespace wellspace::server
