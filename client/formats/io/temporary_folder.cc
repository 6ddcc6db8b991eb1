#include "client/formats/io/temporary_folder.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace wellspace::formats {

absl::StatusOr<TemporaryFolder> TemporaryFolder::Make() {
  const char* const wanted = std::getenv("TMPDIR");
  std::string path = absl::StrCat(wanted == nullptr || *wanted == '\0' ? "/tmp" : wanted, "/wellspace-XXXXXX");
  if (mkdtemp(path.data()) == nullptr) {
    return absl::ResourceExhaustedError(absl::StrCat(path, ": cannot be made: ", std::strerror(errno)));
  }
  return TemporaryFolder(std::move(path));
}

TemporaryFolder::~TemporaryFolder() {
  if (!path_.empty()) {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
}

}  // namespace wellspace::formats
