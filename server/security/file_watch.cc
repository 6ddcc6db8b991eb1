#include "server/security/file_watch.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstdint>
#include <fstream>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace wellspace::server {
namespace {

constexpr off_t kMaxBytes = 16 * 1024 * 1024;

}  // namespace

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  struct stat info;
  if (stat(path.c_str(), &info) != 0) {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", path));
  }
  if (!S_ISREG(info.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat(path, " is no regular file"));
  }
  if (info.st_size > kMaxBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, " has ", info.st_size, " bytes; at most ", kMaxBytes, " are read"));
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", path));
  }
  std::string content(info.st_size, '\0');
  file.read(content.data(), info.st_size);
  content.resize(file.gcount());
  if (file.bad()) {
    return absl::UnavailableError(absl::StrCat("cannot read ", path));
  }
  return content;
}

// The state of a file; all zero when there is none.
struct FileWatch::Mark {
  uint64_t device = 0;
  uint64_t inode = 0;
  int64_t size = 0;
  int64_t seconds = 0;
  int64_t nanoseconds = 0;

  bool operator==(const Mark&) const = default;
};

FileWatch::FileWatch(std::vector<std::string> paths) : paths_(std::move(paths)), marks_(Look()) {}

FileWatch::~FileWatch() = default;

void FileWatch::Start(absl::Duration interval, std::function<void()> on_change) {
  thread_ = std::jthread([this, interval, on_change = std::move(on_change)](std::stop_token stop) {
    Run(std::move(stop), interval, on_change);
  });
}

std::vector<FileWatch::Mark> FileWatch::Look() const {
  std::vector<Mark> marks;
  for (const std::string& path : paths_) {
    struct stat info;
    marks.push_back(stat(path.c_str(), &info) != 0 ? Mark()
                                                   : Mark{.device = info.st_dev,
                                                          .inode = info.st_ino,
                                                          .size = info.st_size,
                                                          .seconds = info.st_mtim.tv_sec,
                                                          .nanoseconds = info.st_mtim.tv_nsec});
  }
  return marks;
}

void FileWatch::Run(std::stop_token stop, absl::Duration interval, const std::function<void()>& on_change) {
  std::unique_lock lock(mutex_);
  while (
      !stopped_.wait_for(lock, stop, absl::ToChronoNanoseconds(interval), [&stop] { return stop.stop_requested(); })) {
    if (std::vector<Mark> marks = Look(); marks != marks_) {
      marks_ = std::move(marks);
      on_change();
    }
  }
}

}  // namespace wellspace::server
