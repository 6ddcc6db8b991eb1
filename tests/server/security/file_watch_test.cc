// Every kind of change of a watched file is noticed, and told once.
#include "server/security/file_watch.h"

#include <filesystem>
#include <functional>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

constexpr absl::Duration kInterval = absl::Milliseconds(1);

// Whether a watch of `path` notices the change by `change`.
bool Notices(const std::string& path, const std::function<void()>& change) {
  Event changed;
  FileWatch watch({path});
  change();
  watch.Start(kInterval, [&changed] { changed.Set(); });
  return changed.Wait();
}

TEST(FileWatch, NoticesEveryKindOfChange) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("file", "one");
  EXPECT_TRUE(Notices(path, [&] { folder.Write("file", "longer"); }));
  EXPECT_TRUE(Notices(path, [&] { std::filesystem::rename(folder.Write("beside", "longer"), path); }));
  EXPECT_TRUE(Notices(path, [&] { std::filesystem::remove(path); }));
  EXPECT_TRUE(Notices(path, [&] { folder.Write("file", "again"); }));
}

TEST(FileWatch, NoticesALinkThatIsSwapped) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.Path("a"));
  std::filesystem::create_directories(folder.Path("b"));
  folder.Write("a/file", "same");
  folder.Write("b/file", "same");
  std::filesystem::create_directory_symlink("a", folder.Path("current"));
  EXPECT_TRUE(Notices(folder.Path("current/file"), [&] {
    std::filesystem::create_directory_symlink("b", folder.Path("next"));
    std::filesystem::rename(folder.Path("next"), folder.Path("current"));
  }));
}

TEST(FileWatch, CallsOnceForAChange) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("file", "one");
  std::mutex mutex;
  std::condition_variable changed;
  int calls = 0;
  {
    FileWatch watch({path, folder.Path("none")});
    watch.Start(kInterval, [&] {
      std::lock_guard lock(mutex);
      ++calls;
      changed.notify_all();
    });
    for (int i = 1; i <= 3; ++i) {
      folder.Write("beside", std::string(i, 'x'));
      std::filesystem::rename(folder.Path("beside"), path);
      std::unique_lock lock(mutex);
      ASSERT_TRUE(changed.wait_for(lock, std::chrono::minutes(1), [&] { return calls >= i; }));
    }
  }
  EXPECT_EQ(calls, 3);
}

TEST(ReadFile, ReadsRegularFilesOnly) {
  const TemporaryFolder folder;
  EXPECT_EQ(*ReadFile(folder.Write("file", std::string("a\0b\n", 4))), std::string("a\0b\n", 4));
  EXPECT_EQ(*ReadFile(folder.Write("empty", "")), "");
  EXPECT_EQ(ReadFile(folder.Path("none")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadFile(folder.Path("")).status().code(), absl::StatusCode::kInvalidArgument);
  const std::string large = folder.Write("large", "");
  std::filesystem::resize_file(large, (16 << 20) + 1);
  EXPECT_EQ(ReadFile(large).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace wellspace::server
