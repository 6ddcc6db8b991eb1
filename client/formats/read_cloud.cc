#include "client/formats/read_cloud.h"

#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/open_input.h"
#include "client/formats/registry.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

using CloudReader = absl::Status (*)(InputFile&, const CloudOptions&, PointCloud&);
using TextReader = absl::Status (*)(LineReader&, const CloudOptions&, PointCloud&);

// A reader of lines as a reader of a file.
template <TextReader kReader>
absl::Status ReadText(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  LineReader reader(std::move(file));
  WELLSPACE_RETURN_IF_ERROR(kReader(reader, options, cloud));
  return reader.Finish();
}

// The same, of a format that has nothing but coordinates to choose among.
template <TextReader kReader>
absl::Status ReadCoordinates(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  if (options.columns.empty()) {
    return ReadText<kReader>(file, options, cloud);
  }
  CloudOptions all = options;
  all.dimension = 0;
  if (absl::Status status = ReadText<kReader>(file, all, cloud); !status.ok() || cloud.dimension == 0) {
    return status;
  }
  return TakeColumns(options, cloud);
}

std::span<const Format<CloudReader>> CloudReaders() {
  static const std::vector<Format<CloudReader>> readers = {
      {"csv", {".csv", ".tsv", ".txt", ".dat"}, ReadText<ReadCsv>},
      {"xyz", {".xyz"}, ReadText<ReadXyz>},
      {"node", {".node"}, ReadCoordinates<ReadNode>},
      {"ply", {".ply"}, ReadText<ReadPly>},
      {"obj", {".obj"}, ReadCoordinates<ReadObj>},
      {"off", {".off"}, ReadCoordinates<ReadOff>},
      {"npy", {".npy"}, ReadNpy},
      {"asc", {".asc"}, ReadText<ReadAsc>},
      {"pts", {".pts"}, ReadText<ReadPts>},
      {"stl", {".stl"}, ReadStl},
      {"pcd", {".pcd"}, ReadText<ReadPcd>},
      {"las", {".las", ".laz"}, ReadText<ReadLas>},
      {"vtk", {".vtk"}, ReadText<ReadVtkPoints>},
      {"vtp", {".vtp"}, ReadVtp},
      {"vtu", {".vtu"}, ReadVtuPoints},
  };
  return readers;
}

}  // namespace

std::vector<std::string> CloudFormats() { return FormatNames(CloudReaders()); }

std::string CloudFormatOf(const std::string& path, const std::string& format) {
  const auto row = FindInputFormat(CloudReaders(), path, format.empty() && path == kStandardStream ? "csv" : format);
  return row.ok() ? (*row)->name : std::string();
}

absl::StatusOr<PointCloud> ReadCloud(const std::string& path, const CloudOptions& options) {
  const std::string format = options.format.empty() && path == kStandardStream ? "csv" : options.format;
  const auto row = FindInputFormat(CloudReaders(), path, format);
  if (!row.ok()) {
    return row.status();
  }
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  PointCloud cloud;
  cloud.name = file.name();
  WELLSPACE_RETURN_IF_ERROR((*row)->handler(file, options, cloud));
  // Columns in which words stand were given up.
  std::erase_if(cloud.attributes, [&](const PointAttribute& attribute) {
    return cloud.size() == 0 || attribute.values.size() != cloud.size();
  });
  if (cloud.skipped > 0) {
    cloud.notes.push_back(absl::StrCat(cloud.name, ": ", cloud.skipped,
                                       cloud.skipped == 1 ? " point is" : " points are",
                                       " left out, of which a coordinate is missing or not finite"));
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
