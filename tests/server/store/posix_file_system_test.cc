// Files, folders, locks and errors on the real disk.
#include <filesystem>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/file_system.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

class PosixFileSystemTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }

  const TestFolder folder_;
  FileSystem& files_ = PosixFileSystem();
};

TEST_F(PosixFileSystemTest, ReadsWhatItWrites) {
  auto file = files_.Open(Path("a"), FileSystem::Mode::kCreateOrWrite);
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_TRUE((*file)->WriteAt(3, std::string("defg")).ok());
  ASSERT_TRUE((*file)->WriteAt(0, std::string("abc")).ok());
  EXPECT_TRUE((*file)->Synchronize().ok());
  EXPECT_EQ(*(*file)->Size(), 7u);
  ASSERT_TRUE((*file)->Truncate(6).ok());
  std::string read(10, '.');
  EXPECT_EQ(*(*file)->ReadAt(1, read), 5u) << "fewer, before the end";
  EXPECT_EQ(read, "bcdef.....");
  EXPECT_EQ(*(*file)->ReadAt(100, read), 0u);
  EXPECT_EQ(BytesOfFile(Path("a")), "abcdef");
}

TEST_F(PosixFileSystemTest, OpensForWritingWithoutLossOfWhatIsThere) {
  WriteFile(Path("a"), "abc");
  for (const auto mode : {FileSystem::Mode::kWrite, FileSystem::Mode::kCreateOrWrite}) {
    ASSERT_TRUE(files_.Open(Path("a"), mode).ok());
    EXPECT_EQ(BytesOfFile(Path("a")), "abc");
  }
}

TEST_F(PosixFileSystemTest, ErrorsNameFileAndCause) {
  const absl::Status missing = files_.Open(Path("none"), FileSystem::Mode::kRead).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(missing.message(), Path("none") + ": cannot be opened: No such file or directory");
  EXPECT_EQ(files_.Open(Path("none"), FileSystem::Mode::kWrite).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(files_.Remove(Path("none")).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(files_.Rename(Path("none"), Path("b")).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(files_.List(Path("none")).status().code(), absl::StatusCode::kNotFound);
  WriteFile(Path("a"), "");
  EXPECT_EQ(files_.Open(Path("a/b"), FileSystem::Mode::kRead).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(files_.CreateFolder(Path("a")).code(), absl::StatusCode::kFailedPrecondition);
}

// The device that every write finds full.
TEST_F(PosixFileSystemTest, AFullDiskIsToldApart) {
  auto full = files_.Open("/dev/full", FileSystem::Mode::kWrite);
  ASSERT_TRUE(full.ok()) << full.status();
  const absl::Status written = (*full)->WriteAt(0, std::string("a"));
  EXPECT_EQ(written.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(written.message()), HasSubstr("/dev/full: cannot be written: No space left"));
}

TEST_F(PosixFileSystemTest, NamesFilesAndFolders) {
  ASSERT_TRUE(files_.CreateFolder(Path("x/y/z")).ok());
  ASSERT_TRUE(files_.CreateFolder(Path("x/y/z")).ok()) << "again";
  EXPECT_EQ(std::filesystem::status(Path("x/y/z")).permissions(), std::filesystem::perms::owner_all);
  WriteFile(Path("x/a"), "a");
  ASSERT_TRUE(files_.Rename(Path("x/a"), Path("x/b")).ok());
  ASSERT_TRUE(files_.Link(Path("x/b"), Path("x/c")).ok());
  ASSERT_TRUE(files_.SynchronizeFolder(Path("x")).ok());
  EXPECT_THAT(*files_.List(Path("x")), UnorderedElementsAre("b", "c", "y"));
  ASSERT_TRUE(files_.Remove(Path("x/b")).ok());
  EXPECT_EQ(BytesOfFile(Path("x/c")), "a");
}

TEST_F(PosixFileSystemTest, ALockIsHeldUntilItsEnd) {
  auto lock = files_.Lock(Path("lock"));
  ASSERT_TRUE(lock.ok()) << lock.status();
  const absl::Status second = files_.Lock(Path("lock")).status();
  EXPECT_EQ(second.code(), absl::StatusCode::kAborted);
  EXPECT_EQ(second.message(), std::to_string(::getpid()));
  lock->reset();
  EXPECT_TRUE(files_.Lock(Path("lock")).ok());
}

}  // namespace
}  // namespace wellspace::server
