#include "client/formats/write_mesh.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/line_reader.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/registry.h"

namespace wellspace::formats {
namespace {

using MeshWriter = absl::Status (*)(const std::string&, const MeshView&, std::stop_token);

std::span<const Format<MeshWriter>> Writers() {
  static const std::vector<Format<MeshWriter>> writers = {
      {"vtu", {".vtu"}, WriteVtu},
      {"node", {".node", ".ele"}, WriteNodeAndEle},
  };
  return writers;
}

absl::StatusOr<MeshWriter> FindWriter(const std::string& path, const std::string& format) {
  const bool is_stream = path == kStandardStream;
  const auto row = FindFormat(Writers(), path, format.empty() && is_stream ? "vtu" : format);
  if (!row.ok()) {
    return row.status();
  }
  if (is_stream && (*row)->handler == WriteNodeAndEle) {
    return absl::InvalidArgumentError("node is a pair of files and cannot go to standard output; expected vtu");
  }
  return (*row)->handler;
}

}  // namespace

std::vector<std::string> MeshFormats() { return FormatNames(Writers()); }

absl::Status CheckMeshOutput(const std::string& path, const std::string& format) {
  if (const absl::StatusOr<MeshWriter> writer = FindWriter(path, format); !writer.ok()) {
    return writer.status();
  }
  if (path == kStandardStream) {
    return absl::OkStatus();
  }
  const size_t slash = path.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  struct stat attributes;
  const bool exists = stat(path.c_str(), &attributes) == 0;
  if (exists && S_ISDIR(attributes.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": it is a folder; expected a file"));
  }
  const bool is_device = exists && !S_ISREG(attributes.st_mode);
  if (access(is_device ? path.c_str() : folder.c_str(), W_OK) != 0) {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot write ", path));
  }
  return absl::OkStatus();
}

absl::Status WriteMesh(const std::string& path, const std::string& format, const MeshView& mesh, std::stop_token stop) {
  const absl::StatusOr<MeshWriter> writer = FindWriter(path, format);
  if (!writer.ok()) {
    return writer.status();
  }
  return (*writer)(path, mesh, std::move(stop));
}

}  // namespace wellspace::formats
