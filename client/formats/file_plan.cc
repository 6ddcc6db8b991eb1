#include "client/formats/file_plan.h"

#include <sys/stat.h>
#include <unistd.h>

#include <optional>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"

namespace wellspace::formats {
namespace {

// Device, inode, and for a file that is not there yet, whose folder they are, its name.
using Identity = std::tuple<dev_t, ino_t, std::string>;

std::optional<Identity> IdentityOf(const std::string& path, bool is_written) {
  struct stat attributes;
  const bool is_stream = path == kStandardStream;
  const int found =
      is_stream ? fstat(is_written ? STDOUT_FILENO : STDIN_FILENO, &attributes) : stat(path.c_str(), &attributes);
  if (found == 0) {
    return S_ISREG(attributes.st_mode) ? std::make_optional<Identity>(attributes.st_dev, attributes.st_ino, "")
                                       : std::nullopt;
  }
  const size_t name = path.find_last_of('/') + 1;  // 0 where there is no slash
  const std::string folder = name == 0 ? "." : path.substr(0, name);
  if (is_stream || stat(folder.c_str(), &attributes) != 0) {
    return std::nullopt;
  }
  return Identity(attributes.st_dev, attributes.st_ino, path.substr(name));
}

std::string Named(const std::string& argument, const std::string& path, bool is_written) {
  if (path == kStandardStream) {
    return absl::StrCat(argument, " (standard ", is_written ? "output)" : "input)");
  }
  return absl::StrCat(argument, " ", path);
}

}  // namespace

void FilePlan::Reads(const std::string& argument, const std::string& path) {
  if (!path.empty()) {
    files_.push_back({Named(argument, path, false), path, false});
  }
}

void FilePlan::Writes(const std::string& argument, const std::string& path) {
  if (!path.empty()) {
    files_.push_back({Named(argument, path, true), path, true});
  }
}

void FilePlan::ReadsMesh(const std::string& argument, const std::string& path) {
  for (const std::string& file : FilesOfMeshRead(path)) {
    files_.push_back({Named(argument, path, false), file, false});
  }
}

void FilePlan::WritesMesh(const std::string& argument, const std::string& path, const std::string& format) {
  for (const std::string& file : FilesOfMeshWritten(path, format)) {
    files_.push_back({Named(argument, path, true), file, true});
  }
}

absl::Status FilePlan::Check() const {
  for (size_t i = 0; i < files_.size(); ++i) {
    const File& written = files_[i];
    const std::optional<Identity> identity =
        written.is_written ? IdentityOf(written.path, /*is_written=*/true) : std::nullopt;
    for (size_t k = 0; identity.has_value() && k < files_.size(); ++k) {
      const File& other = files_[k];
      if (k == i || (other.is_written && k < i) || IdentityOf(other.path, other.is_written) != identity) {
        continue;
      }
      return absl::InvalidArgumentError(absl::StrCat(written.argument, " would write ", written.path,
                                                     other.is_written ? ", and so would " : ", the same file as ",
                                                     other.argument, "; expected files of their own"));
    }
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
