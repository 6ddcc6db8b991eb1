// Files, as far as the store of sessions needs them. Tests put a disk that fails, or loses power, in their place.
#ifndef WELLSPACE_SERVER_STORE_FILE_SYSTEM_H_
#define WELLSPACE_SERVER_STORE_FILE_SYSTEM_H_

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace wellspace::server {

// An open file.
//
// Thread safety: thread-compatible; Synchronize may run beside the others.
// Errors:     of all functions here and in FileSystem: NOT_FOUND (no such file); RESOURCE_EXHAUSTED (no room: ENOSPC,
//             EDQUOT, EFBIG; or no descriptor or memory: EMFILE, ENFILE, ENOMEM); PERMISSION_DENIED (EACCES, EPERM,
//             EROFS); FAILED_PRECONDITION (ENOTDIR, EISDIR); else UNAVAILABLE. The message names the file.
class File {
 public:
  virtual ~File() = default;

  // Reads as many bytes as `bytes` has, or, before the end of the file, fewer; says how many.
  virtual absl::StatusOr<uint64_t> ReadAt(uint64_t offset, std::span<char> bytes) const = 0;
  // Writes all of `bytes`. On an error some of them may have been written.
  virtual absl::Status WriteAt(uint64_t offset, std::span<const char> bytes) = 0;
  virtual absl::Status Truncate(uint64_t size) = 0;
  virtual absl::StatusOr<uint64_t> Size() const = 0;
  // Bytes and size outlive a loss of power from now on. After an error the contents of the disk are not known.
  virtual absl::Status Synchronize() = 0;
};

// An open folder, whose names can be synchronised however many descriptors are in use.
//
// Thread safety: thread-safe.
class Folder {
 public:
  virtual ~Folder() = default;

  // As FileSystem::SynchronizeFolder.
  virtual absl::Status Synchronize() = 0;
};

// A lock that is held as long as this lives, and as the process does.
class FileLock {
 public:
  virtual ~FileLock() = default;
};

// Thread safety: thread-safe.
class FileSystem {
 public:
  // kRead, kWrite: the file has to be there. Files that are made can be read by this user alone.
  enum class Mode { kRead, kWrite, kCreateOrWrite };

  virtual ~FileSystem() = default;

  virtual absl::StatusOr<std::unique_ptr<File>> Open(const std::string& path, Mode mode) = 0;
  virtual absl::Status Rename(const std::string& from, const std::string& to) = 0;
  virtual absl::Status Remove(const std::string& path) = 0;
  // Gives the file `from` the name `to` besides, which must not be there yet. UNAVAILABLE also where the two would be
  // on different disks.
  virtual absl::Status Link(const std::string& from, const std::string& to) = 0;
  // Names of the files and folders in a folder, in any order.
  virtual absl::StatusOr<std::vector<std::string>> List(const std::string& folder) = 0;
  // The folder, and those above it, if they are not there yet. Only this user may look into it.
  virtual absl::Status CreateFolder(const std::string& folder) = 0;
  // The names in the folder outlive a loss of power from now on.
  virtual absl::Status SynchronizeFolder(const std::string& folder) = 0;
  // Where nothing is kept open: SynchronizeFolder by another name.
  virtual absl::StatusOr<std::unique_ptr<Folder>> OpenFolder(const std::string& folder);

  // Locks the folder itself, whatever becomes of the names in it.
  //
  // Errors:     ABORTED: it is locked already; the message is empty.
  virtual absl::StatusOr<std::unique_ptr<FileLock>> LockFolder(const std::string& folder) = 0;
  // Locks the file, which is made if it is not there yet, and writes the number of this process into it.
  //
  // Errors:     ABORTED: it is locked already; the message is the text that the holder has written.
  virtual absl::StatusOr<std::unique_ptr<FileLock>> Lock(const std::string& path) = 0;
};

// That of the machine.
FileSystem& PosixFileSystem();

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_FILE_SYSTEM_H_
