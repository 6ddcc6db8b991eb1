#include "server/store/written_files.h"

#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::server {

absl::StatusOr<WrittenFiles::OpenFile> WrittenFiles::Open(FileSystem& files, const std::string& path,
                                                          FileSystem::Mode mode) {
  {
    const std::lock_guard lock(mutex_);
    if (taken_ == places_) {
      return absl::ResourceExhaustedError(
          absl::StrCat(path, ": ", places_, " files are being written, which is as many as may be at once; wait for ",
                       "other uploads, or raise the limit of file descriptors (ulimit -n)"));
    }
    ++taken_;
  }
  const auto give_back = [self = shared_from_this()] {
    const std::lock_guard lock(self->mutex_);
    --self->taken_;
  };
  auto failed = absl::MakeCleanup(give_back);
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<File> file, files.Open(path, mode));
  std::move(failed).Cancel();
  return OpenFile(file.release(), [give_back](File* open) {
    delete open;
    give_back();
  });
}

}  // namespace wellspace::server
