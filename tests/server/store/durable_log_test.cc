// Sessions, points and meshes outlive the log; missing files cost their session alone.
#include "server/store/durable_log.h"

#include <atomic>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/memory_mesh.h"
#include "server/store/sqlite.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

class DurableLogTest : public ::testing::Test {
 protected:
  std::unique_ptr<SessionLog> Open() {
    auto log = OpenDurableLog({.folder = folder_.path()});
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? *std::move(log) : nullptr;
  }

  std::vector<std::string> Files() { return *PosixFileSystem().List(folder_.path() + "/files"); }

  const TestFolder folder_;
};

TEST_F(DurableLogTest, ASessionOutlivesIt) {
  const core::Mesh mesh = MakeMesh({.vertices = 50, .simplices = 80});
  const std::vector<double> points = {1, 2, 3, 4, 5, 6};
  std::string before;
  {
    const auto log = Open();
    EXPECT_TRUE(log->is_durable());
    EXPECT_THAT(log->records().Load()->sessions, IsEmpty());
    ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
    const auto store = log->files().OpenPoints({.session = SessionName(1), .dimension = 3});
    ASSERT_TRUE(store->Append(points).ok());
    ASSERT_TRUE(store->Synchronize().ok());
    const auto kept = log->files().KeepMesh(SessionName(1), 2, /*epoch=*/0, mesh, core::RunContext());
    ASSERT_TRUE(kept.ok()) << kept.status();
    store::v1::SessionRecord state = MakeState(1, 2);
    state.set_points(2);
    *state.mutable_mesh() = (*kept)->record();
    ASSERT_TRUE(
        CommitTo(*log, {.session = SessionName(1), .state = state, .steps = {MakePointsStep(0, points, 3)}}).ok());
    before = TextOf(*log->records().Load());
  }
  const auto log = Open();
  const auto stored = log->records().Load();
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(TextOf(*stored), before);
  const StoredSession& session = stored->sessions.at(0);
  const auto store =
      log->files().OpenPoints({.session = SessionName(1), .dimension = 3, .committed = {session.steps.at(0).points()}});
  EXPECT_EQ(*store->CopyFrom(0, core::RunContext()), points);
  EXPECT_EQ(*DownloadOf(*log->files().FindMesh(session.state), true), *DownloadOf(MemoryMesh(2, mesh), true));
  EXPECT_EQ(log->files().FindMesh(MakeState(2)), nullptr);
  EXPECT_THAT(log->RemoveGarbage()->set_aside, IsEmpty());
}

TEST_F(DurableLogTest, ManyCommitAtOnce) {
  constexpr int kThreads = 16;
  constexpr int kCommits = 25;
  {
    const auto log = Open();
    std::vector<std::thread> threads;
    std::atomic<int> failed = 0;
    for (int thread = 0; thread < kThreads; ++thread) {
      threads.emplace_back([&, thread] {
        for (int i = 0; i < kCommits; ++i) {
          SessionChange change{.session = SessionName(thread), .state = MakeState(thread, i)};
          change.steps = {MakePointsStep(i, {1, 2, static_cast<double>(i)}, 3)};
          change.answer = MakeAnswer(absl::StrCat(thread), absl::StrCat(i), "done");
          failed += CommitTo(*log, change).ok() ? 0 : 1;
          // Of a session that is not there: costs itself alone.
          const SessionChange fault{.session = "sessions/none", .steps = {MakePointsStep(0, {1}, 1)}};
          failed += IsOwnedElsewhere(CommitTo(*log, fault)) ? 0 : 1;
          if (i > 0) {
            log->records().Forget(std::vector<AnswerKey>{{absl::StrCat(thread), absl::StrCat(i - 1)}});
          }
        }
      });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    EXPECT_EQ(failed, 0);
    // Takes with it the last that are forgotten.
    ASSERT_TRUE(CommitTo(*log, {.session = "", .answer = MakeAnswer("last", "", "")}).ok());
  }
  const auto stored = Open()->records().Load();
  ASSERT_EQ(stored->sessions.size(), size_t{kThreads});
  for (const StoredSession& session : stored->sessions) {
    EXPECT_EQ(session.state.revision(), uint64_t{kCommits - 1});
    ASSERT_EQ(session.steps.size(), size_t{kCommits});
    for (int i = 0; i < kCommits; ++i) {
      EXPECT_EQ(session.steps[i].points().first(), static_cast<uint64_t>(i)) << "in the order of the commits";
    }
  }
  EXPECT_EQ(stored->answers.size(), size_t{kThreads + 1});
}

TEST_F(DurableLogTest, ADeletionTakesTheFiles) {
  const auto log = Open();
  ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
  auto store = log->files().OpenPoints({.session = SessionName(1), .dimension = 3});
  ASSERT_TRUE(store->Append(std::vector<double>{1, 2, 3}).ok());
  auto mesh = *log->files().KeepMesh(SessionName(1), 1, /*epoch=*/0, MakeMesh({}), core::RunContext());
  store::v1::SessionRecord state = MakeState(1, 1);
  state.set_points(1);
  *state.mutable_mesh() = mesh->record();
  ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = state}).ok());
  ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .is_deletion = true}).ok());
  EXPECT_THAT(Files(), UnorderedElementsAre("00000001.mesh-1", "00000001.points")) << "an upload has them still";
  store.reset();
  EXPECT_THAT(Files(), UnorderedElementsAre("00000001.mesh-1")) << "a download has it still";
  EXPECT_TRUE(DownloadOf(*mesh, true).ok());
  EXPECT_THAT(log->RemoveGarbage()->set_aside, IsEmpty());
  mesh.reset();
  EXPECT_THAT(Files(), IsEmpty());
}

TEST_F(DurableLogTest, AMeshThatNoChangeHasNamedIsGarbage) {
  {
    const auto log = Open();
    ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
    const auto mesh = log->files().KeepMesh(SessionName(1), 1, /*epoch=*/0, MakeMesh({}), core::RunContext());
    EXPECT_THAT(log->RemoveGarbage()->set_aside, IsEmpty()) << "it is about to be named";
  }
  const auto log = Open();
  const Garbage garbage = *log->RemoveGarbage();
  ASSERT_EQ(garbage.set_aside.size(), 1u);
  EXPECT_EQ(garbage.set_aside[0].from, folder_.path() + "/files/00000001.mesh-1");
  EXPECT_THAT(garbage.set_aside[0].to, StartsWith(folder_.path() + "/lost/00000001.mesh-1."));
  EXPECT_TRUE(std::filesystem::exists(garbage.set_aside[0].to));
  EXPECT_THAT(Files(), IsEmpty());
}

// The database without its files, or with them: sessions that are gone are not made anew as none.
TEST_F(DurableLogTest, ADatabaseThatIsMissingOrEmptyIsNotMadeAnew) {
  {
    const auto log = Open();
    ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
    const auto store = log->files().OpenPoints({.session = SessionName(1), .dimension = 3});
    ASSERT_TRUE(store->Append(std::vector<double>{1, 2, 3}).ok());
    ASSERT_TRUE(store->Synchronize().ok());
  }
  const std::string database = folder_.path() + "/sessions.db";
  const std::string mark = folder_.path() + "/sessions.db-mark";
  const std::string whole = BytesOfFile(database);
  const std::string whole_mark = BytesOfFile(mark);
  // Points without a mark, as an earlier release has left them; a mark without points; the log alone.
  for (const std::string_view there : {"points and mark", "points", "mark", "log"}) {
    std::filesystem::remove(folder_.path() + "/files/00000001.points");
    std::filesystem::remove(mark);
    if (there.starts_with("points")) {
      WriteFile(folder_.path() + "/files/00000001.points", std::string(24, 'x'));
    }
    if (there.ends_with("mark")) {
      WriteFile(mark, whole_mark);
    }
    for (const std::string_view what : {"missing", "empty", "without tables"}) {
      std::filesystem::remove(database);
      std::filesystem::remove(database + "-wal");
      if (what == "empty") {
        WriteFile(database, "");
      } else if (what == "without tables") {
        const auto empty = SqliteDatabase::Open(database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
        ASSERT_TRUE((*empty)->Execute("PRAGMA journal_mode=WAL; PRAGMA user_version=0").ok());
      }
      if (there == "log") {
        if (what == "without tables") {
          continue;  // as a start leaves it that has ended before it made them
        }
        WriteFile(database + "-wal", "a log");
      }
      const absl::Status status = OpenDurableLog({.folder = folder_.path()}).status();
      EXPECT_EQ(ReasonOf(status), "FILE_DAMAGED") << there << ", " << what;
      EXPECT_THAT(std::string(status.message()), StartsWith(database + ": the database is "));
      EXPECT_EQ(std::filesystem::exists(folder_.path() + "/files/00000001.points"), there.starts_with("points"));
      EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/lost"));
    }
  }
  std::filesystem::remove(database + "-wal");
  WriteFile(database, whole);
  const auto log = Open();
  ASSERT_NE(log, nullptr) << "the database is back";
  EXPECT_EQ(log->records().Load()->sessions.size(), 1u);
}

// An old copy of the database, or one whose rows are gone, cannot be told from one after deletions. So what it does not
// name is kept for a day, and can be put back.
TEST_F(DurableLogTest, FilesThatTheDatabaseDoesNotNameAreKeptForADay) {
  static absl::Time now;
  now = absl::FromUnixSeconds(1'800'000'000);
  const DurableLogOptions options{.folder = folder_.path(), .now = [] { return now; }};
  const std::string database = folder_.path() + "/sessions.db";
  OpenDurableLog(options)->reset();
  const std::string old = BytesOfFile(database);
  {
    const auto log = *OpenDurableLog(options);
    ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
    const auto store = log->files().OpenPoints({.session = SessionName(1), .dimension = 3});
    ASSERT_TRUE(store->Append(std::vector<double>{1, 2, 3}).ok());
    ASSERT_TRUE(store->Synchronize().ok());
    store::v1::SessionRecord state = MakeState(1, 1);
    state.set_points(1);
    ASSERT_TRUE(
        CommitTo(*log, {.session = SessionName(1), .state = state, .steps = {MakePointsStep(0, {1, 2, 3}, 3)}}).ok());
  }
  const std::string points = BytesOfFile(folder_.path() + "/files/00000001.points");
  const std::string last = BytesOfFile(database);
  WriteFile(database, old);
  const std::string lost = folder_.path() + "/lost/00000001.points.1800000000";
  {
    const auto log = *OpenDurableLog(options);
    EXPECT_TRUE(log->records().Load()->sessions.empty());
    const Garbage first = *log->RemoveGarbage();
    ASSERT_EQ(first.set_aside.size(), 1u);
    EXPECT_EQ(first.set_aside[0].to, lost);
    EXPECT_EQ(BytesOfFile(lost), points);
    now += absl::Hours(24) - absl::Seconds(1);
    EXPECT_THAT(log->RemoveGarbage()->removed, IsEmpty());
  }
  now += absl::Hours(1);
  {
    const auto log = *OpenDurableLog(options);
    EXPECT_THAT(log->RemoveGarbage()->removed, IsEmpty()) << "nothing is removed at a start";
    EXPECT_TRUE(std::filesystem::exists(lost));
    EXPECT_THAT(log->RemoveGarbage()->unknown, IsEmpty());
    EXPECT_FALSE(std::filesystem::exists(lost));
  }
  // Put back within the day, all is as it was.
  WriteFile(database, last);
  WriteFile(folder_.path() + "/files/00000001.points", points);
  const auto log = *OpenDurableLog(options);
  EXPECT_EQ(log->records().Load()->sessions.size(), 1u);
  EXPECT_THAT(log->RemoveGarbage()->set_aside, IsEmpty());
}

TEST_F(DurableLogTest, MissingFilesCostTheirSessionAlone) {
  {
    const auto log = Open();
    for (const uint64_t number : {1, 2}) {
      store::v1::SessionRecord state = MakeState(number, 1);
      ASSERT_TRUE(CommitTo(*log, {.session = SessionName(number), .state = state}).ok());
      *state.mutable_mesh() =
          (*log->files().KeepMesh(SessionName(number), 1, /*epoch=*/0, MakeMesh({}), core::RunContext()))->record();
      ASSERT_TRUE(CommitTo(*log, {.session = SessionName(number), .state = state}).ok());
    }
  }
  std::filesystem::remove(folder_.path() + "/files/00000001.mesh-1");
  const auto log = Open();
  const auto stored = log->records().Load();
  ASSERT_EQ(stored->sessions.size(), 2u);
  const absl::Status missing = DownloadOf(*log->files().FindMesh(stored->sessions[0].state), false).status();
  EXPECT_EQ(ReasonOf(missing), "FILE_DAMAGED");
  EXPECT_THAT(std::string(missing.message()), HasSubstr("/files/00000001.mesh-1"));
  EXPECT_TRUE(DownloadOf(*log->files().FindMesh(stored->sessions[1].state), false).ok());
}

TEST_F(DurableLogTest, HasOneServerAtATime) {
  const auto log = Open();
  EXPECT_EQ(OpenDurableLog({.folder = folder_.path()}).status().code(), absl::StatusCode::kFailedPrecondition);
  // A lock whose name is gone holds, too.
  for (int i = 0; i < 2; ++i) {
    std::filesystem::remove(folder_.path() + "/lock");
    const absl::Status second = OpenDurableLog({.folder = folder_.path()}).status();
    EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(second.message(), folder_.path() +
                                    ": another process has this folder in use; stop it first, or name "
                                    "another folder");
  }
}

}  // namespace
}  // namespace wellspace::server
