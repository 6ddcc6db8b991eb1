#include "server/store/durable_log.h"

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/memory_mesh.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class DurableLogTest : public ::testing::Test {
 protected:
  std::unique_ptr<DurableLog> Open() {
    auto log = DurableLog::Open({.folder = folder_.path()});
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
    EXPECT_THAT(log->Load()->sessions, IsEmpty());
    ASSERT_TRUE(log->Commit({.session = SessionName(1), .state = MakeState(1)}).ok());
    const auto store = log->OpenPoints(SessionName(1), 3, 0, {});
    ASSERT_TRUE(store->Append(points).ok());
    ASSERT_TRUE(store->Synchronize().ok());
    const auto kept = log->KeepMesh(SessionName(1), 2, mesh, core::RunContext());
    ASSERT_TRUE(kept.ok()) << kept.status();
    store::v1::SessionRecord state = MakeState(1, 2);
    state.set_points(2);
    *state.mutable_mesh() = *(*kept)->record();
    ASSERT_TRUE(log->Commit({.session = SessionName(1), .state = state, .steps = {MakePointsStep(0, points, 3)}}).ok());
    before = TextOf(*log->Load());
  }
  const auto log = Open();
  const auto stored = log->Load();
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(TextOf(*stored), before);
  const StoredSession& session = stored->sessions.at(0);
  const auto store = log->OpenPoints(SessionName(1), 3, 0, {session.steps.at(0).points()});
  EXPECT_EQ(*store->CopyFrom(0, core::RunContext()), points);
  EXPECT_EQ(*DownloadOf(*log->FindMesh(SessionName(1), session.state), true), *DownloadOf(MemoryMesh(2, mesh), true));
  EXPECT_EQ(log->FindMesh(SessionName(2), MakeState(2)), nullptr);
  EXPECT_THAT(log->RemoveGarbage()->removed, IsEmpty());
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
          failed += log->Commit(change).ok() ? 0 : 1;
          // Of a session that is not there: costs itself alone.
          const SessionChange fault{.session = "sessions/none", .steps = {MakePointsStep(0, {1}, 1)}};
          failed += ReasonOf(log->Commit(fault)) == "INTERNAL" ? 0 : 1;
          if (i > 0) {
            log->Forget(std::vector<AnswerKey>{{absl::StrCat(thread), absl::StrCat(i - 1)}});
          }
        }
      });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    EXPECT_EQ(failed, 0);
    // Takes with it the last that are forgotten.
    ASSERT_TRUE(log->Commit({.session = "", .answer = MakeAnswer("last", "", "")}).ok());
  }
  const auto stored = Open()->Load();
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
  ASSERT_TRUE(log->Commit({.session = SessionName(1), .state = MakeState(1)}).ok());
  const auto store = log->OpenPoints(SessionName(1), 3, 0, {});
  ASSERT_TRUE(store->Append(std::vector<double>{1, 2, 3}).ok());
  auto mesh = *log->KeepMesh(SessionName(1), 1, MakeMesh({}), core::RunContext());
  store::v1::SessionRecord state = MakeState(1, 1);
  *state.mutable_mesh() = *mesh->record();
  ASSERT_TRUE(log->Commit({.session = SessionName(1), .state = state}).ok());
  ASSERT_TRUE(log->Commit({.session = SessionName(1), .is_deletion = true}).ok());
  EXPECT_THAT(Files(), UnorderedElementsAre("00000001.mesh-1")) << "a download has it still";
  EXPECT_TRUE(DownloadOf(*mesh, true).ok());
  EXPECT_THAT(log->RemoveGarbage()->removed, IsEmpty());
  mesh.reset();
  EXPECT_THAT(Files(), IsEmpty());
}

TEST_F(DurableLogTest, AMeshThatNoChangeHasNamedIsGarbage) {
  {
    const auto log = Open();
    ASSERT_TRUE(log->Commit({.session = SessionName(1), .state = MakeState(1)}).ok());
    const auto mesh = log->KeepMesh(SessionName(1), 1, MakeMesh({}), core::RunContext());
    EXPECT_THAT(log->RemoveGarbage()->removed, IsEmpty()) << "it is about to be named";
  }
  const auto log = Open();
  EXPECT_EQ(log->RemoveGarbage()->removed.size(), 1u);
  EXPECT_THAT(Files(), IsEmpty());
}

TEST_F(DurableLogTest, MissingFilesCostTheirSessionAlone) {
  {
    const auto log = Open();
    for (const uint64_t number : {1, 2}) {
      store::v1::SessionRecord state = MakeState(number, 1);
      ASSERT_TRUE(log->Commit({.session = SessionName(number), .state = state}).ok());
      *state.mutable_mesh() = *(*log->KeepMesh(SessionName(number), 1, MakeMesh({}), core::RunContext()))->record();
      ASSERT_TRUE(log->Commit({.session = SessionName(number), .state = state}).ok());
    }
  }
  std::filesystem::remove(folder_.path() + "/files/00000001.mesh-1");
  const auto log = Open();
  const auto stored = log->Load();
  ASSERT_EQ(stored->sessions.size(), 2u);
  const absl::Status missing = DownloadOf(*log->FindMesh(SessionName(1), stored->sessions[0].state), false).status();
  EXPECT_EQ(ReasonOf(missing), "FILE_DAMAGED");
  EXPECT_THAT(std::string(missing.message()), HasSubstr("/files/00000001.mesh-1"));
  EXPECT_TRUE(DownloadOf(*log->FindMesh(SessionName(2), stored->sessions[1].state), false).ok());
}

TEST_F(DurableLogTest, HasOneServerAtATime) {
  const auto log = Open();
  EXPECT_EQ(DurableLog::Open({.folder = folder_.path()}).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace wellspace::server
