// Folders for files that are not kept.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_TEMPORARY_FOLDER_H_
#define WELLSPACE_CLIENT_FORMATS_IO_TEMPORARY_FOLDER_H_

#include <string>
#include <utility>

#include "absl/status/statusor.h"

namespace wellspace::formats {

// A folder that this user alone can look into, which goes with the object and all that is in it.
//
// Thread safety: thread-compatible.
class TemporaryFolder {
 public:
  // In $TMPDIR, or in /tmp.
  //
  // Errors:     RESOURCE_EXHAUSTED: it cannot be made.
  static absl::StatusOr<TemporaryFolder> Make();
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, "")) {}
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder();

  const std::string& path() const { return path_; }
  // Leaves the folder there.
  void Keep() { path_.clear(); }

 private:
  explicit TemporaryFolder(std::string path) : path_(std::move(path)) {}

  std::string path_;  // empty: it does not go
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_TEMPORARY_FOLDER_H_
