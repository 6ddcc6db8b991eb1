// The folder of files that are being written, and places for those that are open.
#ifndef WELLSPACE_SERVER_STORE_WRITTEN_FILES_H_
#define WELLSPACE_SERVER_STORE_WRITTEN_FILES_H_

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/file_system.h"

namespace wellspace::server {

// The folder, which stays open: a synchronisation must not fail for want of a descriptor, after which it would not be
// known what is on the disk. And places for files that stay open until they are synchronised, so that descriptors are
// left for all else.
//
// Thread safety: thread-safe.
class WrittenFiles : public std::enable_shared_from_this<WrittenFiles> {
 public:
  // A file that is open in a place, which it has until its end.
  using OpenFile = std::shared_ptr<File>;

  WrittenFiles(std::unique_ptr<Folder> folder, uint64_t places) : folder_(std::move(folder)), places_(places) {}

  // Opens a file in a place.
  //
  // Errors:     RESOURCE_EXHAUSTED: no place is free; those of FileSystem::Open.
  absl::StatusOr<OpenFile> Open(FileSystem& files, const std::string& path, FileSystem::Mode mode);

  Folder& folder() const { return *folder_; }

 private:
  const std::unique_ptr<Folder> folder_;
  const uint64_t places_;
  std::mutex mutex_;
  uint64_t taken_ = 0;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_WRITTEN_FILES_H_
