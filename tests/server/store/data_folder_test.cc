// The folder of a server: its rights, its lock, its names and its garbage.
#include "server/store/data_folder.h"

#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class DataFolderTest : public ::testing::Test {
 protected:
  const TestFolder folder_;
  const std::string root_ = folder_.path() + "/var/data";
  const DataPaths paths_{root_};
  const absl::Time now_ = absl::FromUnixSeconds(1'800'000'000);
};

TEST_F(DataFolderTest, IsMadeForThisUserAlone) {
  const auto folder = DataFolder::Open(root_, PosixFileSystem());
  ASSERT_TRUE(folder.ok()) << folder.status();
  EXPECT_EQ(std::filesystem::status(root_).permissions(), std::filesystem::perms::owner_all);
  EXPECT_TRUE(std::filesystem::is_directory(paths_.files()));
}

TEST_F(DataFolderTest, HasOneServerAtATime) {
  auto folder = DataFolder::Open(root_, PosixFileSystem());
  ASSERT_TRUE(folder.ok());
  const absl::Status second = DataFolder::Open(root_, PosixFileSystem()).status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(second.message(), root_ + ": process " + std::to_string(::getpid()) +
                                  " has this folder in use; stop it first, or name another folder");
  folder->reset();
  EXPECT_TRUE(DataFolder::Open(root_, PosixFileSystem()).ok());
}

TEST_F(DataFolderTest, IsNoFile) {
  WriteFile(folder_.path() + "/file", "");
  const absl::Status status = DataFolder::Open(folder_.path() + "/file", PosixFileSystem()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("/file: cannot be used: Not a directory"));
}

store::v1::PointsFile FileOf(uint64_t number, uint64_t epoch) {
  store::v1::PointsFile file;
  file.set_number(number);
  file.set_epoch(epoch);
  return file;
}

TEST_F(DataFolderTest, FilesHaveTheirSessionsNamesAndTheEpochsOfTheirOwners) {
  EXPECT_EQ(paths_.points("sessions/01ef", FileOf(0, 0)), root_ + "/files/01ef.points");
  EXPECT_EQ(paths_.mesh("sessions/01ef", 12, 0), root_ + "/files/01ef.mesh-12");
  EXPECT_EQ(paths_.points("sessions/../x", FileOf(0, 0)), root_ + "/files/x73657373696f6e732f2e2e2f78.points");
  EXPECT_EQ(paths_.points("sessions/01ef", FileOf(12, 0)), root_ + "/files/01ef.points-12");
  EXPECT_EQ(paths_.points("sessions/01ef", FileOf(12, 3)), root_ + "/files/01ef.points-12-3");
  EXPECT_EQ(paths_.mesh("sessions/01ef", 12, 3), root_ + "/files/01ef.mesh-12-3");
  for (const char* name : {"01ef.points", "x73.points", "01ef.points-12", "01ef.mesh-12", "01ef.mesh-12.tmp"}) {
    EXPECT_EQ(EpochOfName(name), 0) << name;
  }
  for (const char* name : {"01ef.points-12-3", "01ef.mesh-12-3", "01ef.mesh-12-3.tmp"}) {
    EXPECT_EQ(EpochOfName(name), 3) << name;
  }
  for (const char* name : {"",
                           "01ef",
                           ".points",
                           "x.points",
                           "01eF.points",
                           "01ef.points.tmp",
                           "01ef.points-",
                           "01ef.points-x",
                           "01ef.points12",
                           "01ef.mesh-",
                           "notes.txt",
                           "01ef.mesh-1x",
                           "01ef.mesh",
                           "01ef.mesh-.tmp",
                           "01ef.mesh-1.tmp.tmp",
                           "g.points",
                           "01ef.mesh-1-",
                           "01ef.mesh-1-2-3",
                           "01ef.points--3",
                           "01ef.mesh-1-99999999999999999999"}) {
    EXPECT_EQ(EpochOfName(name), std::nullopt) << name;
  }
}

// Of two owners of one folder neither takes files that the other may still have named.
TEST_F(DataFolderTest, LeavesWhatOtherOwnersMayStillHaveNamed) {
  const auto folder = DataFolder::Open(root_, PosixFileSystem());
  ASSERT_TRUE(folder.ok());
  const auto in_use = std::make_shared<FilesInUse>(PosixFileSystem());
  for (const char* name : {"aa.points-1-3", "aa.mesh-2-4", "aa.mesh-3-4.tmp", "bb.points-1-5", "bb.mesh-2-6.tmp"}) {
    WriteFile(paths_.files() + "/" + name, "x");
  }
  const auto use = in_use->Take(paths_.files() + "/bb.points-1-5", /*is_written=*/true);
  const auto sweep = [&](uint64_t own, uint64_t oldest) {
    EXPECT_TRUE((*folder)
                    ->RemoveGarbage(
                        *in_use, [&](uint64_t epoch) { return epoch == own; },
                        [&] { return Census{.sessions = {}, .oldest_epoch = oldest}; }, now_)
                    .ok());
    return PosixFileSystem().List(paths_.files()).value();
  };
  EXPECT_THAT(sweep(5, 4), UnorderedElementsAre("aa.mesh-2-4", "aa.mesh-3-4.tmp", "bb.points-1-5", "bb.mesh-2-6.tmp"))
      << "the owner at 3 is no more; that at 4 lives, and makes a mesh";
  EXPECT_THAT(sweep(4, 4), UnorderedElementsAre("bb.points-1-5", "bb.mesh-2-6.tmp"));
  EXPECT_THAT(sweep(6, 6), UnorderedElementsAre("bb.points-1-5")) << "this process has it";
}

// Epochs of a process that has none.
bool OwnsNone(uint64_t /*epoch*/) { return false; }

TEST_F(DataFolderTest, SetsAsideWhatNoSessionNamesAndLeavesWhatItDoesNotKnow) {
  const auto folder = DataFolder::Open(root_, PosixFileSystem());
  ASSERT_TRUE(folder.ok());
  const auto in_use = std::make_shared<FilesInUse>(PosixFileSystem());
  store::v1::SessionRecord session = MakeState(1);
  session.set_name("sessions/aa");
  session.set_points(1);
  session.mutable_mesh()->set_revision(3);
  for (const char* name : {"aa.points", "aa.mesh-2", "aa.mesh-3", "aa.mesh-3.tmp", "bb.points", "bb.mesh-1",
                           "cc.mesh-1", "cc.mesh-1.tmp", "notes.txt"}) {
    WriteFile(paths_.files() + "/" + name, "x");
  }
  WriteFile(root_ + "/core", "x");
  ASSERT_TRUE(PosixFileSystem().CreateFolder(paths_.lost()).ok());
  WriteFile(paths_.lost() + "/aa.mesh-2.1800000000", "of the second before");
  WriteFile(paths_.lost() + "/letter", "x");
  const auto use = in_use->Take(paths_.files() + "/cc.mesh-1", /*is_written=*/true);
  const auto written = in_use->Take(paths_.files() + "/cc.mesh-1.tmp", /*is_written=*/true);
  const auto sweep = (*folder)->RemoveGarbage(
      *in_use, OwnsNone, [&] { return Census{.sessions = {session}, .oldest_epoch = 1}; }, now_);
  ASSERT_TRUE(sweep.ok()) << sweep.status();
  std::vector<std::string> set_aside;
  for (const Garbage::SetAside& file : sweep->set_aside) {
    set_aside.push_back(file.from.substr(root_.size()) + " " + file.to.substr(root_.size()));
  }
  EXPECT_THAT(
      set_aside,
      ElementsAre("/files/aa.mesh-2 /lost/aa.mesh-2.1800000001", "/files/aa.mesh-3.tmp /lost/aa.mesh-3.tmp.1800000000",
                  "/files/bb.mesh-1 /lost/bb.mesh-1.1800000000", "/files/bb.points /lost/bb.points.1800000000"));
  EXPECT_EQ(BytesOfFile(paths_.lost() + "/aa.mesh-2.1800000000"), "of the second before");
  EXPECT_THAT(sweep->removed, IsEmpty());
  EXPECT_THAT(sweep->unknown, ElementsAre(root_ + "/core", paths_.files() + "/notes.txt", paths_.lost() + "/letter"));
  EXPECT_THAT(*PosixFileSystem().List(paths_.files()),
              UnorderedElementsAre("aa.points", "aa.mesh-3", "cc.mesh-1", "cc.mesh-1.tmp", "notes.txt"));
}

TEST_F(DataFolderTest, KnowsTheDatabaseThatAMoveHasLeft) {
  const auto folder = DataFolder::Open(root_, PosixFileSystem());
  ASSERT_TRUE(folder.ok());
  WriteFile(root_ + "/sessions.db.moved", "x");
  const auto in_use = std::make_shared<FilesInUse>(PosixFileSystem());
  const auto sweep = (*folder)->RemoveGarbage(
      *in_use, OwnsNone, [] { return Census{.sessions = {}, .oldest_epoch = 1}; }, now_);
  ASSERT_TRUE(sweep.ok()) << sweep.status();
  EXPECT_THAT(sweep->unknown, IsEmpty());
  EXPECT_TRUE(std::filesystem::exists(root_ + "/sessions.db.moved"));
}

// A folder with leftovers of the same names whenever it is listed; says when it is, and refuses to change.
class Leftovers final : public FileSystem {
 public:
  Leftovers(std::vector<std::string> names, std::function<void()> on_list)
      : names_(std::move(names)), on_list_(std::move(on_list)) {}

  absl::StatusOr<std::unique_ptr<File>> Open(const std::string& path, Mode /*mode*/) override {
    return absl::UnimplementedError(path);
  }
  absl::Status Rename(const std::string& /*from*/, const std::string& /*to*/) override {
    ++renames_;
    return absl::OkStatus();
  }
  absl::Status Remove(const std::string& path) override { return absl::UnimplementedError(path); }
  absl::Status Link(const std::string& from, const std::string& /*to*/) override {
    return absl::UnimplementedError(from);
  }
  absl::StatusOr<std::vector<std::string>> List(const std::string& folder) override {
    if (!folder.ends_with("/files")) {
      return std::vector<std::string>();
    }
    on_list_();
    return names_;
  }
  absl::Status CreateFolder(const std::string& /*folder*/) override { return absl::OkStatus(); }
  absl::Status SynchronizeFolder(const std::string& /*folder*/) override { return absl::OkStatus(); }
  absl::StatusOr<std::unique_ptr<FileLock>> LockFolder(const std::string& folder) override {
    return absl::UnimplementedError(folder);
  }
  absl::StatusOr<std::unique_ptr<FileLock>> Lock(const std::string& path) override {
    return absl::UnimplementedError(path);
  }

  int renames() const { return renames_; }

 private:
  const std::vector<std::string> names_;
  const std::function<void()> on_list_;
  int renames_ = 0;
};

// A writer takes the names of leftovers while a sweep looks at them; the rows are read once it has taken all.
TEST_F(DataFolderTest, LeavesFilesAloneThatAreTakenWhileItLooks) {
  constexpr int kSweeps = 50;
  constexpr int kFiles = 200;
  std::vector<std::string> names;
  for (int i = 0; i < kFiles; ++i) {
    names.push_back(absl::StrCat("aa.mesh-", 1000 + i));
  }
  for (int i = 0; i < kSweeps; ++i) {
    std::atomic<bool> is_listed = false;
    Leftovers files(names, [&] { is_listed = true; });
    const auto folder = DataFolder::OpenShared(root_, files);
    ASSERT_TRUE(folder.ok()) << folder.status();
    const auto in_use = std::make_shared<FilesInUse>(files);
    std::vector<std::unique_ptr<FilesInUse::Use>> uses;
    absl::Notification is_taken;
    std::thread writer([&] {
      while (!is_listed) {
      }
      for (const std::string& name : names) {
        uses.push_back(in_use->Take(absl::StrCat(paths_.files(), "/", name), /*is_written=*/true));
      }
      is_taken.Notify();
    });
    const auto sweep = (*folder)->RemoveGarbage(
        *in_use, OwnsNone,
        [&] {
          is_taken.WaitForNotification();
          return Census{.sessions = {}, .oldest_epoch = 1};
        },
        now_);
    writer.join();
    uses.clear();
    ASSERT_TRUE(sweep.ok()) << sweep.status();
    ASSERT_EQ(files.renames(), 0) << "in sweep " << i;
  }
}

// Between the look at the folder and the look at the rows a mesh is written, named and no longer read.
TEST_F(DataFolderTest, LeavesAFileAloneThatIsWrittenMeanwhile) {
  const auto folder = DataFolder::Open(root_, PosixFileSystem());
  ASSERT_TRUE(folder.ok());
  const auto in_use = std::make_shared<FilesInUse>(PosixFileSystem());
  for (const char* name : {"/aa.mesh-1", "/aa.mesh-1.tmp"}) {
    const std::string path = paths_.files() + name;
    WriteFile(path, "of a process that died");
    const auto sweep = (*folder)->RemoveGarbage(
        *in_use, OwnsNone,
        [&] {
          in_use->Take(path, /*is_written=*/true).reset();
          return Census{.sessions = {}, .oldest_epoch = 1};
        },
        now_);
    ASSERT_TRUE(sweep.ok()) << sweep.status();
    EXPECT_TRUE(std::filesystem::exists(path));
  }
}

TEST_F(DataFolderTest, ALostFilesNameSaysWhenItWasFound) {
  EXPECT_EQ(FoundAt("01ef.points.1800000000"), now_);
  EXPECT_EQ(FoundAt("01ef.mesh-3.tmp.1800000000"), now_);
  for (const char* name : {"01ef.points", "01ef.points.", "01ef.points.x", "01ef.points.-1", "letter.1800000000",
                           "01ef.points.99999999999999999999"}) {
    EXPECT_EQ(FoundAt(name), std::nullopt) << name;
  }
}

TEST_F(DataFolderTest, RemovesNothingWhereTheRowsCannotBeRead) {
  const auto folder = DataFolder::Open(root_, PosixFileSystem());
  ASSERT_TRUE(folder.ok());
  const auto in_use = std::make_shared<FilesInUse>(PosixFileSystem());
  WriteFile(paths_.files() + "/aa.points", "x");
  EXPECT_FALSE((*folder)
                   ->RemoveGarbage(
                       *in_use, OwnsNone, [] { return absl::DataLossError("damaged"); }, now_)
                   .ok());
  EXPECT_TRUE(std::filesystem::exists(paths_.files() + "/aa.points"));
}

}  // namespace
}  // namespace wellspace::server
