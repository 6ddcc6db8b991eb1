#include "client/formats/read_cloud.h"

#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/registry.h"

namespace wellspace::formats {
namespace {

using CloudReader = absl::Status (*)(InputFile&, int, PointCloud&);

// A reader of lines as a reader of a file.
template <absl::Status (*kReader)(LineReader&, int, PointCloud&)>
absl::Status ReadText(InputFile& file, int dimension, PointCloud& cloud) {
  LineReader reader(std::move(file));
  if (absl::Status status = kReader(reader, dimension, cloud); !status.ok()) {
    return status;
  }
  return reader.status();
}

std::span<const Format<CloudReader>> Readers() {
  static const std::vector<Format<CloudReader>> readers = {
      {"csv", {".csv", ".tsv", ".txt", ".dat"}, ReadText<ReadCsv>},
      {"xyz", {".xyz"}, ReadText<ReadXyz>},
      {"node", {".node"}, ReadText<ReadNode>},
      {"ply", {".ply"}, ReadText<ReadPly>},
      {"obj", {".obj"}, ReadText<ReadObj>},
      {"off", {".off"}, ReadText<ReadOff>},
      {"npy", {".npy"}, ReadNpy},
  };
  return readers;
}

}  // namespace

std::vector<std::string> CloudFormats() { return FormatNames(Readers()); }

absl::StatusOr<PointCloud> ReadCloud(const std::string& path, const CloudOptions& options) {
  const std::string format = options.format.empty() && path == kStandardStream ? "csv" : options.format;
  const auto row = FindFormat(Readers(), path, format);
  if (!row.ok()) {
    return row.status();
  }
  absl::StatusOr<InputFile> file = InputFile::Open(path);
  if (!file.ok()) {
    return file.status();
  }
  PointCloud cloud;
  cloud.name = file->name();
  if (absl::Status status = (*row)->handler(*file, options.dimension, cloud); !status.ok()) {
    return status;
  }
  if (cloud.dimension == 0) {
    if (options.dimension == 0) {
      return absl::InvalidArgumentError(
          absl::StrCat(cloud.name, ": no points; expected at least one, or to be told the dimension"));
    }
    cloud.dimension = options.dimension;
  }
  return cloud;
}

}  // namespace wellspace::formats
