#include "client/formats/io/output_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/file_error.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kBufferBytes = 1 << 18;
constexpr int kPollMilliseconds = 100;

// The temporary files of this process.
//
// Thread safety: thread-safe. Never destroyed: a signal may come at the very end.
class TemporaryFiles {
 public:
  static TemporaryFiles& OfProcess() {
    static TemporaryFiles& files = *new TemporaryFiles;
    return files;
  }

  // Opens a new file and notes its name. The system's error is in errno where the descriptor is below 0.
  int Create(const std::string& name) {
    const std::lock_guard lock(mutex_);
    // O_EXCL makes the name ours; the mode leaves the rights to the umask, as for any file.
    const int descriptor = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) {
      names_.insert(name);
    }
    return descriptor;
  }

  // Gives the file its name. False, and errno: it could not.
  bool Rename(const std::string& name, const std::string& wanted) {
    const std::lock_guard lock(mutex_);
    if (std::rename(name.c_str(), wanted.c_str()) != 0) {
      return false;
    }
    names_.erase(name);
    return true;
  }

  void Remove(const std::string& name) {
    const std::lock_guard lock(mutex_);
    unlink(name.c_str());
    names_.erase(name);
  }

  void RemoveAllForGood() {
    mutex_.lock();  // and never unlocked
    for (const std::string& name : names_) {
      unlink(name.c_str());
    }
  }

 private:
  std::mutex mutex_;
  std::set<std::string> names_;
};

// The file that `path` leads to, so that a rename replaces the file and not the link to it.
std::string ResolveLinks(const std::string& path) {
  char resolved[PATH_MAX];
  return realpath(path.c_str(), resolved) != nullptr ? std::string(resolved) : path;
}

absl::Status CreationError(int error, const std::string& path) {
  return OpenOrReadError(error, absl::StrCat("cannot write ", path));
}

}  // namespace

void RemoveTemporaryFilesForGood() { TemporaryFiles::OfProcess().RemoveAllForGood(); }

absl::StatusOr<OutputFile> OutputFile::Create(const std::string& path, std::stop_token stop) {
  if (path == kStandardStream) {
    return OutputFile(STDOUT_FILENO, "<stdout>", "", std::move(stop));
  }
  struct stat attributes;
  const bool exists = stat(path.c_str(), &attributes) == 0;
  if (exists && S_ISDIR(attributes.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": it is a folder; expected a file"));
  }
  if (exists && !S_ISREG(attributes.st_mode)) {
    const int descriptor = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) {
      return CreationError(errno, path);
    }
    return OutputFile(descriptor, path, "", std::move(stop));
  }
  const std::string target = ResolveLinks(path);
  for (int attempt = 0;; ++attempt) {
    const std::string temporary = absl::StrCat(target, ".", getpid(), "-", attempt, ".tmp");
    const int descriptor = TemporaryFiles::OfProcess().Create(temporary);
    if (descriptor >= 0) {
      return OutputFile(descriptor, target, temporary, std::move(stop));
    }
    if (errno != EEXIST) {
      return CreationError(errno, path);
    }
  }
}

OutputFile::OutputFile(int descriptor, std::string path, std::string temporary, std::stop_token stop)
    : descriptor_(descriptor), path_(std::move(path)), temporary_(std::move(temporary)), stop_(std::move(stop)) {
  buffer_.reserve(kBufferBytes);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      stop_(std::move(other.stop_)),
      buffer_(std::move(other.buffer_)),
      size_(other.size_),
      status_(std::move(other.status_)) {}

OutputFile::~OutputFile() {
  if (descriptor_ > STDERR_FILENO) {
    close(descriptor_);
  }
  if (!temporary_.empty()) {
    TemporaryFiles::OfProcess().Remove(temporary_);
  }
}

absl::Status OutputFile::CannotWrite(int error) const {
  return WriteError(error, absl::StrCat("cannot write ", path_));
}

void OutputFile::Write(std::string_view bytes) {
  size_ += bytes.size();
  if (buffer_.size() + bytes.size() > kBufferBytes) {
    Send(buffer_);
    buffer_.clear();
  }
  if (bytes.size() >= kBufferBytes) {
    Send(bytes);
  } else {
    buffer_.append(bytes);
  }
}

void OutputFile::Send(std::string_view bytes) {
  while (status_.ok() && !bytes.empty()) {
    if (stop_.stop_requested()) {
      status_ = absl::CancelledError(absl::StrCat("cancelled while writing ", path_));
      return;
    }
    const ssize_t sent = write(descriptor_, bytes.data(), bytes.size());
    if (sent >= 0) {
      bytes.remove_prefix(sent);
    } else if (errno == EAGAIN) {
      // Standard output is shared, and another process has made it non-blocking. Now and then a request to stop is
      // heard.
      pollfd room = {.fd = descriptor_, .events = POLLOUT, .revents = 0};
      poll(&room, 1, kPollMilliseconds);
    } else if (errno != EINTR) {
      status_ = CannotWrite(errno);
    }
  }
}

void OutputFile::Overwrite(uint64_t offset, std::string_view bytes) {
  Flush().IgnoreError();  // kept in status_
  while (status_.ok() && !bytes.empty()) {
    const ssize_t sent = pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (sent >= 0) {
      bytes.remove_prefix(sent);
      offset += sent;
    } else if (errno != EINTR) {
      status_ = CannotWrite(errno);
    }
  }
}

absl::Status OutputFile::Flush() {
  Send(buffer_);
  buffer_.clear();
  return status_;
}

absl::Status OutputFile::Commit() {
  WELLSPACE_RETURN_IF_ERROR(Flush());
  // Some file systems report a failed write only here.
  if (descriptor_ > STDERR_FILENO && close(std::exchange(descriptor_, -1)) != 0) {
    return CannotWrite(errno);
  }
  if (!temporary_.empty()) {
    if (!TemporaryFiles::OfProcess().Rename(temporary_, path_)) {
      return CannotWrite(errno);
    }
    temporary_.clear();
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
