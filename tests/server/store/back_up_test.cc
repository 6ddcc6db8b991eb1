// A copy of a folder is of one moment, and a server starts on it.
#include "server/store/back_up.h"

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/data_folder.h"
#include "server/store/durable_log.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// The machine's, without links: as if the copy were on another disk.
class NoLinks final : public FileSystem {
 public:
  absl::StatusOr<std::unique_ptr<File>> Open(const std::string& path, Mode mode) override {
    return PosixFileSystem().Open(path, mode);
  }
  absl::Status Rename(const std::string& from, const std::string& to) override {
    return PosixFileSystem().Rename(from, to);
  }
  absl::Status Remove(const std::string& path) override { return PosixFileSystem().Remove(path); }
  absl::Status Link(const std::string& from, const std::string& /*to*/) override {
    return absl::UnavailableError(from + ": Invalid cross-device link");
  }
  absl::StatusOr<std::vector<std::string>> List(const std::string& folder) override {
    return PosixFileSystem().List(folder);
  }
  absl::Status CreateFolder(const std::string& folder) override { return PosixFileSystem().CreateFolder(folder); }
  absl::Status SynchronizeFolder(const std::string& folder) override {
    return PosixFileSystem().SynchronizeFolder(folder);
  }
  absl::StatusOr<std::unique_ptr<FileLock>> LockFolder(const std::string& folder) override {
    return PosixFileSystem().LockFolder(folder);
  }
  absl::StatusOr<std::unique_ptr<FileLock>> Lock(const std::string& path) override {
    return PosixFileSystem().Lock(path);
  }
};

// One more piece of points, and another mesh in the place of the last.
absl::Status Change(SessionLog& log, uint64_t number, uint64_t revision, PointStore& points,
                    std::shared_ptr<MeshSnapshot>& mesh) {
  const std::vector<double> piece = {1, 2, static_cast<double>(revision)};
  SessionChange change{.session = SessionName(number), .state = MakeState(number, revision)};
  if (absl::Status status = points.Append(piece); !status.ok()) {
    return status;
  }
  if (absl::Status status = points.Synchronize(); !status.ok()) {
    return status;
  }
  auto kept = log.files().KeepMesh(change.session, revision, /*epoch=*/0,
                                   MakeMesh({.salt = static_cast<uint32_t>(revision)}), core::RunContext());
  if (!kept.ok()) {
    return kept.status();
  }
  change.steps = {MakePointsStep(revision - 1, piece, 3)};
  change.state->set_points(revision);
  *change.state->mutable_mesh() = (*kept)->record();
  if (absl::Status status = CommitTo(log, change); !status.ok()) {
    return status;
  }
  if (mesh != nullptr) {
    mesh->MakeObsolete();
  }
  mesh = *std::move(kept);
  return absl::OkStatus();
}

class BackUpTest : public ::testing::Test {
 protected:
  const TestFolder folder_;
  const std::string from_ = folder_.path() + "/data";
  const std::string to_ = folder_.path() + "/backups/monday";
};

TEST_F(BackUpTest, AServerStartsOnTheCopy) {
  const auto log = *OpenDurableLog({.folder = from_});
  for (uint64_t number = 1; number <= 3; ++number) {
    ASSERT_TRUE(CommitTo(*log, {.session = SessionName(number), .state = MakeState(number)}).ok());
    const auto points = log->files().OpenPoints({.session = SessionName(number), .dimension = 3});
    std::shared_ptr<MeshSnapshot> mesh;
    for (uint64_t revision = 1; revision <= number; ++revision) {
      ASSERT_TRUE(Change(*log, number, revision, *points, mesh).ok());
    }
    ASSERT_TRUE(points->Append(std::vector<double>(30, 1.0)).ok()) << "an upload is under way";
  }
  NoLinks no_links;
  for (FileSystem* files : {&PosixFileSystem(), static_cast<FileSystem*>(&no_links)}) {
    const std::string to = to_ + (files == &no_links ? " 2" : "");
    const auto report = BackUp(from_, to, {.files = files});
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_EQ(report->sessions, 3u);
    EXPECT_EQ(report->points, 6u);
    EXPECT_EQ(report->meshes, 3u);
    const auto restored = OpenDurableLog({.folder = to});
    ASSERT_TRUE(restored.ok()) << restored.status();
    EXPECT_EQ(TextOf(*(*restored)->records().Load()), TextOf(*log->records().Load()));
    EXPECT_THAT((*restored)->RemoveGarbage()->set_aside, IsEmpty());
    EXPECT_EQ(std::filesystem::file_size(to + "/files/00000003.points"), 72u) << "the committed ones alone";
  }
}

TEST_F(BackUpTest, IsOfOneMomentWhateverAServerDoesMeanwhile) {
  const auto log = *OpenDurableLog({.folder = from_});
  std::atomic<bool> is_over = false;
  std::atomic<int> failed = 0;
  std::vector<std::thread> writers;
  for (uint64_t writer = 1; writer <= 2; ++writer) {
    writers.emplace_back([&, writer] {
      for (uint64_t number = writer; !is_over; number += 2) {
        failed += CommitTo(*log, {.session = SessionName(number), .state = MakeState(number)}).ok() ? 0 : 1;
        const auto points = log->files().OpenPoints({.session = SessionName(number), .dimension = 3});
        std::shared_ptr<MeshSnapshot> mesh;
        for (uint64_t revision = 1; revision < 10; ++revision) {
          failed += Change(*log, number, revision, *points, mesh).ok() ? 0 : 1;
        }
        if (number % 3 != 0) {
          failed += CommitTo(*log, {.session = SessionName(number), .is_deletion = true}).ok() ? 0 : 1;
        }
      }
    });
  }
  for (int i = 0; i < 5; ++i) {
    const auto report = BackUp(from_, to_ + std::to_string(i));
    EXPECT_TRUE(report.ok()) << report.status();
    const auto check = CheckData(from_);
    ASSERT_TRUE(check.ok()) << check.status();
    EXPECT_THAT(check->problems, IsEmpty());
  }
  is_over = true;
  for (std::thread& writer : writers) {
    writer.join();
  }
  EXPECT_EQ(failed, 0);
}

// Files that the copied rows name have to stay until they are copied, too.
TEST_F(BackUpTest, AServerRemovesNothingMeanwhile) {
  const auto log = *OpenDurableLog({.folder = from_});
  std::shared_ptr<MeshSnapshot> mesh;
  ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
  auto points = log->files().OpenPoints({.session = SessionName(1), .dimension = 3});
  ASSERT_TRUE(Change(*log, 1, 1, *points, mesh).ok());
  for (const bool has_name : {true, false}) {
    // As a back-up holds them; the name of the one is gone in the second round.
    const auto number = PosixFileSystem().Lock(DataPaths{from_}.back_up_lock());
    const auto back_up = PosixFileSystem().LockFolder(DataPaths{from_}.files());
    ASSERT_TRUE(number.ok() && back_up.ok());
    if (!has_name) {
      std::filesystem::remove(DataPaths{from_}.back_up_lock());
    }
    const absl::Status second = BackUp(from_, to_).status();
    EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(second.message()), HasSubstr("is backing this folder up"));
    if (has_name) {
      ASSERT_TRUE(Change(*log, 1, 2, *points, mesh).ok());
      ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .is_deletion = true}).ok());
      mesh.reset();
      points.reset();
    }
    const absl::StatusOr<Garbage> kept = log->RemoveGarbage();
    ASSERT_TRUE(kept.ok());
    EXPECT_THAT(kept->set_aside, IsEmpty()) << "nor does it say so";
    EXPECT_EQ(PosixFileSystem().List(from_ + "/files")->size(), 3u);
  }
  const absl::StatusOr<Garbage> set_aside = log->RemoveGarbage();
  ASSERT_TRUE(set_aside.ok());
  EXPECT_EQ(set_aside->set_aside.size(), 3u);
  EXPECT_THAT(*PosixFileSystem().List(from_ + "/files"), IsEmpty());
}

TEST_F(BackUpTest, WantsAFolderOfItsOwn) {
  const auto log = *OpenDurableLog({.folder = from_});
  const absl::Status self = BackUp(from_, from_).status();
  EXPECT_EQ(self.code(), absl::StatusCode::kFailedPrecondition);
  std::filesystem::create_directory_symlink(from_, folder_.path() + "/link");
  for (const std::string& within :
       {from_ + "/copy", from_ + "/files/copy", from_ + "/../data/x/y", folder_.path() + "/link/copy"}) {
    const absl::Status status = BackUp(from_ + "/", within).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(status.message()), HasSubstr(within + ": is within "));
    EXPECT_FALSE(std::filesystem::exists(within)) << within;
  }
  std::filesystem::create_directories(to_);
  WriteFile(to_ + "/letter.txt", "");
  const absl::Status full = BackUp(from_, to_).status();
  EXPECT_EQ(full.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(full.message()), HasSubstr("not empty"));
}

TEST_F(BackUpTest, SaysThatTheFolderIsNotWhole) {
  const auto log = *OpenDurableLog({.folder = from_});
  ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
  const auto points = log->files().OpenPoints({.session = SessionName(1), .dimension = 3});
  std::shared_ptr<MeshSnapshot> mesh;
  ASSERT_TRUE(Change(*log, 1, 1, *points, mesh).ok());
  FlipBit(from_ + "/files/00000001.points", 3, 3);
  const absl::Status damaged = BackUp(from_, to_).status();
  EXPECT_EQ(damaged.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(damaged.message()), HasSubstr("00000001.points"));
  std::filesystem::remove(from_ + "/files/00000001.points");
  const absl::Status missing = BackUp(from_, to_ + "2").status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(missing.message()), HasSubstr("00000001.points"));
}

}  // namespace
}  // namespace wellspace::server
