#include "client/formats/read_cloud.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
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
      {"vts", {".vts"}, ReadVts},
      {"vtu", {".vtu"}, ReadVtuPoints},
      {"vtr", {".vtr"}, ReadVtr},
      {"vti", {".vti"}, ReadVti},
      {"pvtp", {".pvtp"}, ReadPvtp},
      {"pvts", {".pvts"}, ReadPvts},
      {"pvtu", {".pvtu"}, ReadPvtu},
      {"pvtr", {".pvtr"}, ReadPvtr},
      {"pvti", {".pvti"}, ReadPvti},
      {"msh", {".msh"}, ReadText<ReadMshPoints>},
      {"medit", {".mesh"}, ReadText<ReadMeditPoints>},
      {"npz", {".npz"}, ReadNpzPoints},
      {"adcirc", {".14", ".grd", ".gr3"}, ReadText<ReadAdcircPoints>},
      {"2dm", {".2dm"}, ReadText<Read2dmPoints>},
  };
  return readers;
}

// Formats in which points have three coordinates, in the plane, too.
constexpr std::array<std::string_view, 13> kPadded = {"vtk",  "vtp",  "vts",  "vtu",  "vtr", "vti",  "pvtp",
                                                      "pvts", "pvtu", "pvtr", "pvti", "msh", "medit"};

// Of points that all have the same z: takes them in the plane if that is 0 and only there since the format wants it, or
// tells how to take them so. Points of other formats have the dimension that was asked for.
//
// Errors:     INVALID_ARGUMENT for points in space where those of the plane are wanted.
absl::Status TakeFlatPoints(const CloudOptions& options, bool is_padded, PointCloud& cloud) {
  if (cloud.dimension != 3 || !options.columns.empty() || options.dimension == 3) {
    return absl::OkStatus();
  }
  const std::vector<double>& points = cloud.points;
  if (cloud.size() == 0) {
    cloud.dimension = is_padded && options.dimension == 2 ? 2 : 3;
    return absl::OkStatus();
  }
  bool is_flat = true;
  for (size_t i = 2; i < points.size() && is_flat; i += 3) {
    is_flat = points[i] == points[2];
  }
  if (is_padded && is_flat && points[2] == 0) {
    const size_t count = cloud.size();
    for (size_t i = 0; i < count; ++i) {
      cloud.points[2 * i] = points[3 * i];
      cloud.points[2 * i + 1] = points[3 * i + 1];
    }
    cloud.points.resize(2 * count);
    cloud.dimension = 2;
    if (options.dimension == 0) {
      cloud.notes.push_back(absl::StrCat(
          cloud.name, ": all points have z = 0, and are taken in the plane; --columns x,y,z takes them in space"));
    }
    return absl::OkStatus();
  }
  if (options.dimension == 2) {
    return absl::InvalidArgumentError(
        absl::StrCat(cloud.name, ": expected 2 coordinates, got 3; --columns x,y takes 2 of them"));
  }
  if (is_flat && cloud.size() > 3) {
    std::string z;
    AppendNumber(points[2], z);
    cloud.notes.push_back(absl::StrCat(cloud.name, ": all points have z = ", z,
                                       ", and are taken in space; --columns x,y takes them in the plane"));
  }
  return absl::OkStatus();
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
  const bool is_padded = std::find(kPadded.begin(), kPadded.end(), (*row)->name) != kPadded.end();
  // Two coordinates of points that have three in any such file.
  CloudOptions wanted = options;
  if (is_padded && options.columns.empty() && options.dimension == 2) {
    wanted.dimension = 0;
  }
  WELLSPACE_RETURN_IF_ERROR((*row)->handler(file, wanted, cloud));
  WELLSPACE_RETURN_IF_ERROR(TakeFlatPoints(options, is_padded, cloud));
  // Columns in which words stand were given up.
  std::erase_if(cloud.attributes, [&](const Attribute& attribute) {
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
