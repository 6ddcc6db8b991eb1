#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/file_system.h"

namespace wellspace::server {
namespace {

constexpr mode_t kFileMode = 0600;
constexpr mode_t kFolderMode = 0700;

absl::StatusCode CodeOfErrno(int error) {
  switch (error) {
    case ENOENT:
      return absl::StatusCode::kNotFound;
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
    case EMFILE:
    case ENFILE:
    case ENOMEM:
      return absl::StatusCode::kResourceExhausted;
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::StatusCode::kPermissionDenied;
    case ENOTDIR:
    case EISDIR:
      return absl::StatusCode::kFailedPrecondition;
    default:
      return absl::StatusCode::kUnavailable;
  }
}

// The error of a call of the system that has just failed.
absl::Status SystemError(const std::string& path, const char* what) {
  const int error = errno;
  return {CodeOfErrno(error), absl::StrCat(path, ": ", what, ": ", std::strerror(error))};
}

// Repeats a system call that a signal has interrupted. Not for close, whose descriptor is gone then.
template <typename Call>
auto Uninterrupted(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) {
    result = call();
  }
  return result;
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) {
      ::close(number_);  // data that matter were synchronised, and their errors told there
    }
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int number() const { return number_; }

 private:
  const int number_;
};

class PosixFile final : public File {
 public:
  PosixFile(std::string path, int number) : path_(std::move(path)), descriptor_(number) {}

  absl::StatusOr<uint64_t> ReadAt(uint64_t offset, std::span<char> bytes) const override {
    uint64_t done = 0;
    while (done < bytes.size()) {
      const ssize_t count = Uninterrupted([&] {
        return ::pread(descriptor_.number(), bytes.data() + done, bytes.size() - done,
                       static_cast<off_t>(offset + done));
      });
      if (count < 0) {
        return SystemError(path_, "cannot be read");
      }
      if (count == 0) {
        break;
      }
      done += count;
    }
    return done;
  }

  absl::Status WriteAt(uint64_t offset, std::span<const char> bytes) override {
    uint64_t done = 0;
    while (done < bytes.size()) {
      const ssize_t count = Uninterrupted([&] {
        return ::pwrite(descriptor_.number(), bytes.data() + done, bytes.size() - done,
                        static_cast<off_t>(offset + done));
      });
      if (count <= 0) {
        errno = count == 0 ? ENOSPC : errno;  // a device that takes nothing more
        return SystemError(path_, "cannot be written");
      }
      done += count;
    }
    return absl::OkStatus();
  }

  absl::Status Truncate(uint64_t size) override {
    return Uninterrupted([&] { return ::ftruncate(descriptor_.number(), static_cast<off_t>(size)); }) == 0
               ? absl::OkStatus()
               : SystemError(path_, "cannot be cut off");
  }

  absl::StatusOr<uint64_t> Size() const override {
    struct stat status {};
    if (::fstat(descriptor_.number(), &status) != 0) {
      return SystemError(path_, "cannot be looked at");
    }
    return static_cast<uint64_t>(status.st_size);
  }

  absl::Status Synchronize() override {
    // Never called again after an error, EINTR excepted: the kernel takes pages that it could not write for written.
    return Uninterrupted([&] { return ::fdatasync(descriptor_.number()); }) == 0
               ? absl::OkStatus()
               : SystemError(path_, "cannot be synchronised");
  }

 private:
  const std::string path_;
  const Descriptor descriptor_;
};

class PosixFolder final : public Folder {
 public:
  PosixFolder(std::string path, int number) : path_(std::move(path)), descriptor_(number) {}

  absl::Status Synchronize() override {
    return Uninterrupted([&] { return ::fsync(descriptor_.number()); }) == 0
               ? absl::OkStatus()
               : SystemError(path_, "cannot be synchronised");
  }

 private:
  const std::string path_;
  const Descriptor descriptor_;
};

// The lock of flock, which goes with its descriptor.
class PosixLock final : public FileLock {
 public:
  explicit PosixLock(std::unique_ptr<Descriptor> descriptor) : descriptor_(std::move(descriptor)) {}

 private:
  const std::unique_ptr<Descriptor> descriptor_;
};

class PosixFiles final : public FileSystem {
 public:
  absl::StatusOr<std::unique_ptr<File>> Open(const std::string& path, Mode mode) override {
    const int flags = mode == Mode::kRead ? O_RDONLY : (mode == Mode::kWrite ? O_RDWR : O_RDWR | O_CREAT);
    const int number = Uninterrupted([&] { return ::open(path.c_str(), flags | O_CLOEXEC, kFileMode); });
    if (number < 0) {
      return SystemError(path, "cannot be opened");
    }
    return std::make_unique<PosixFile>(path, number);
  }

  absl::Status Rename(const std::string& from, const std::string& to) override {
    return ::rename(from.c_str(), to.c_str()) == 0 ? absl::OkStatus()
                                                   : SystemError(from, ("cannot be renamed to " + to).c_str());
  }

  absl::Status Remove(const std::string& path) override {
    return ::unlink(path.c_str()) == 0 ? absl::OkStatus() : SystemError(path, "cannot be removed");
  }

  absl::Status Link(const std::string& from, const std::string& to) override {
    if (::link(from.c_str(), to.c_str()) == 0) {
      return absl::OkStatus();
    }
    // Some file systems have no links, and say so by EPERM.
    errno = errno == EPERM ? EXDEV : errno;
    return SystemError(from, ("cannot be linked to " + to).c_str());
  }

  absl::StatusOr<std::vector<std::string>> List(const std::string& folder) override {
    const std::unique_ptr<DIR, int (*)(DIR*)> entries(::opendir(folder.c_str()), &::closedir);
    if (entries == nullptr) {
      return SystemError(folder, "cannot be listed");
    }
    std::vector<std::string> names;
    while (true) {
      errno = 0;
      const dirent* entry = ::readdir(entries.get());
      if (entry == nullptr) {
        break;
      }
      if (const std::string name = entry->d_name; name != "." && name != "..") {
        names.push_back(name);
      }
    }
    if (errno != 0) {
      return SystemError(folder, "cannot be listed");
    }
    return names;
  }

  absl::Status CreateFolder(const std::string& folder) override {
    for (size_t end = folder.find('/', 1); true; end = folder.find('/', end + 1)) {
      const std::string part = folder.substr(0, end);
      if (::mkdir(part.c_str(), kFolderMode) != 0 && errno != EEXIST) {
        // Folders above may be there, and closed to this user.
        struct stat status {};
        if (const int error = errno; ::stat(part.c_str(), &status) != 0) {
          errno = error;
          return SystemError(part, "cannot be made");
        }
      }
      if (end == std::string::npos) {
        break;
      }
    }
    struct stat status {};
    if (::stat(folder.c_str(), &status) != 0) {
      return SystemError(folder, "cannot be looked at");
    }
    errno = ENOTDIR;
    return S_ISDIR(status.st_mode) ? absl::OkStatus() : SystemError(folder, "cannot be used");
  }

  absl::Status SynchronizeFolder(const std::string& folder) override {
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<Folder> opened, OpenFolder(folder));
    return opened->Synchronize();
  }

  absl::StatusOr<std::unique_ptr<Folder>> OpenFolder(const std::string& folder) override {
    const int number = Uninterrupted([&] { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
    if (number < 0) {
      return SystemError(folder, "cannot be opened");
    }
    return std::make_unique<PosixFolder>(folder, number);
  }

  absl::StatusOr<std::unique_ptr<FileLock>> LockFolder(const std::string& folder) override {
    const int number = Uninterrupted([&] { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
    if (number < 0) {
      return SystemError(folder, "cannot be opened");
    }
    auto descriptor = std::make_unique<Descriptor>(number);
    if (Uninterrupted([&] { return ::flock(number, LOCK_EX | LOCK_NB); }) != 0) {
      return errno == EWOULDBLOCK ? absl::AbortedError("") : SystemError(folder, "cannot be locked");
    }
    return std::make_unique<PosixLock>(std::move(descriptor));
  }

  absl::StatusOr<std::unique_ptr<FileLock>> Lock(const std::string& path) override {
    const int number = Uninterrupted([&] { return ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kFileMode); });
    if (number < 0) {
      return SystemError(path, "cannot be opened");
    }
    auto descriptor = std::make_unique<Descriptor>(number);
    if (Uninterrupted([&] { return ::flock(number, LOCK_EX | LOCK_NB); }) != 0) {
      if (errno != EWOULDBLOCK) {
        return SystemError(path, "cannot be locked");
      }
      std::array<char, 32> holder{};
      const ssize_t count = ::pread(number, holder.data(), holder.size(), 0);
      return absl::AbortedError(std::string(holder.data(), std::max<ssize_t>(count, 0)));
    }
    const std::string self = absl::StrCat(::getpid());
    if ((::ftruncate(number, 0) != 0 || ::pwrite(number, self.data(), self.size(), 0) < 0) && errno != ENOSPC) {
      return SystemError(path, "cannot be written");  // without room the lock holds all the same
    }
    return std::make_unique<PosixLock>(std::move(descriptor));
  }
};

// A folder that is opened whenever it is synchronised.
class FolderByPath final : public Folder {
 public:
  FolderByPath(FileSystem& files, std::string path) : files_(files), path_(std::move(path)) {}

  absl::Status Synchronize() override { return files_.SynchronizeFolder(path_); }

 private:
  FileSystem& files_;
  const std::string path_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Folder>> FileSystem::OpenFolder(const std::string& folder) {
  return std::make_unique<FolderByPath>(*this, folder);
}

FileSystem& PosixFileSystem() {
  static PosixFiles files;
  return files;
}

}  // namespace wellspace::server
