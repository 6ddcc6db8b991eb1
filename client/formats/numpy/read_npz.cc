// numpy's .npz: a mesh as arrays.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/cloud.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/zip_file.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/numpy/npy.h"
#include "client/formats/numpy/npz.h"
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

absl::StatusOr<NpyReader> OpenArray(ZipReader& archive, const std::string& file, const std::string& member,
                                    size_t dimensions = 2) {
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t size, archive.Begin(member));
  return NpyReader::Open(
      absl::StrCat(file, ": ", member), [&archive](char* buffer, size_t bytes) { return archive.Read(buffer, bytes); },
      size, dimensions);
}

// Numbers of the points, of which there are `vertices`.
absl::Status ReadOfPoints(ZipReader& archive, const std::string& file, const std::string& member, const char* what,
                          uint64_t vertices, std::vector<double>& values) {
  WELLSPACE_ASSIGN_OR_RETURN(NpyReader array, OpenArray(archive, file, member, 1));
  if (array.rows() != vertices) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": ", member, ": expected ", vertices, " ", what,
                                                   ", one for each point, got ", array.rows()));
  }
  return array.ReadNumbers(values);
}

// Whole numbers of 32 bits, a row each.
absl::Status ReadTags(ZipReader& archive, const std::string& file, const std::string& member,
                      std::vector<int32_t>& tags) {
  WELLSPACE_ASSIGN_OR_RETURN(NpyReader array, OpenArray(archive, file, member, 1));
  std::vector<double> values;
  WELLSPACE_RETURN_IF_ERROR(array.ReadNumbers(values));
  for (size_t i = 0; i < values.size(); ++i) {
    if (!(std::abs(values[i]) <= std::numeric_limits<int32_t>::max()) || values[i] != std::trunc(values[i])) {
      return absl::InvalidArgumentError(
          absl::StrCat(file, ": ", member, ": row ", i, ": expected a whole number of 32 bits, got ", values[i]));
    }
    tags.push_back(static_cast<int32_t>(values[i]));
  }
  return absl::OkStatus();
}

// Where vertices come from: numbers of input points, or -1, -2 and -3.
absl::Status ReadOrigins(ZipReader& archive, const std::string& file, Mesh& mesh) {
  std::vector<double> values;
  WELLSPACE_RETURN_IF_ERROR(ReadOfPoints(archive, file, kNpzOrigins, "origins", mesh.View().vertex_count(), values));
  constexpr double kLowest = SignedOrigin(kCornerOrigin);
  for (size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= kLowest && values[i] < kCornerOrigin) || values[i] != std::trunc(values[i])) {
      return absl::InvalidArgumentError(absl::StrCat(
          file, ": ", kNpzOrigins, ": row ", i, ": expected the number of a point, or -1, -2 or -3, got ", values[i]));
    }
    mesh.vertex_origins.push_back(static_cast<uint32_t>(static_cast<int64_t>(values[i])));
  }
  return absl::OkStatus();
}

// Texts of UTF-32, a row each.
absl::Status ReadNames(ZipReader& archive, const std::string& file, const std::string& member,
                       std::vector<std::string>& names) {
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t size, archive.Begin(member));
  const auto source = [&archive](char* buffer, size_t bytes) { return archive.Read(buffer, bytes); };
  absl::StatusOr<NpyReader> array = NpyReader::Open(absl::StrCat(file, ": ", member), source, size, 1);
  return array.ok() ? array->ReadTexts(names) : array.status();
}

absl::Status ReadBoundary(ZipReader& archive, const std::string& file, Mesh& mesh) {
  WELLSPACE_ASSIGN_OR_RETURN(NpyReader facets, OpenArray(archive, file, kNpzFacets));
  const uint64_t rows = facets.rows();
  if (facets.columns() != static_cast<uint64_t>(mesh.dimension)) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ": ", kNpzFacets, ": expected ", mesh.dimension, " columns, got ", facets.columns()));
  }
  std::vector<uint32_t> corners;
  WELLSPACE_RETURN_IF_ERROR(facets.ReadIndices(mesh.View().vertex_count(), corners));
  std::vector<int32_t> tags;
  WELLSPACE_RETURN_IF_ERROR(ReadTags(archive, file, kNpzFacetTags, tags));
  if (tags.size() != rows) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ": ", kNpzFacetTags, ": expected ", rows, " tags, one for each facet, got ", tags.size()));
  }
  FacetSorter sorter;
  for (uint64_t row = 0; row < rows; ++row) {
    sorter.Add(std::span(corners).subspan(row * mesh.dimension, mesh.dimension), tags[row]);
  }
  if (archive.Has(kNpzFacetNames) && archive.Has(kNpzFacetNameTags)) {
    std::vector<std::string> names;
    std::vector<int32_t> named;
    absl::Status status = ReadNames(archive, file, kNpzFacetNames, names);
    if (status.ok()) {
      status = ReadTags(archive, file, kNpzFacetNameTags, named);
    }
    if (!status.ok()) {
      return status;
    }
    for (size_t i = 0; i < std::min(names.size(), named.size()); ++i) {
      sorter.Name(named[i], names[i]);
    }
  }
  sorter.MoveTo(mesh);
  return absl::OkStatus();
}

absl::Status ReadRidges(ZipReader& archive, const std::string& file, Mesh& mesh) {
  WELLSPACE_ASSIGN_OR_RETURN(NpyReader ridges, OpenArray(archive, file, kNpzRidges));
  if (mesh.dimension != 3 || ridges.columns() != 2) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": ", kNpzRidges,
                                                   ": expected 2 columns, of points in 3-D, got ", ridges.columns(),
                                                   " in ", mesh.dimension, "-D"));
  }
  return ridges.ReadIndices(mesh.View().vertex_count(), mesh.ridges);
}

absl::Status ReadRegions(ZipReader& archive, const std::string& file, Mesh& mesh) {
  std::vector<int32_t> ids;
  WELLSPACE_RETURN_IF_ERROR(ReadTags(archive, file, kNpzRegions, ids));
  if (ids.size() != mesh.View().simplex_count()) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": ", kNpzRegions, ": expected ", mesh.View().simplex_count(),
                                                   " regions, one for each simplex, got ", ids.size()));
  }
  RegionCollector collector;
  for (const int32_t id : ids) {
    collector.Add(id);
  }
  if (archive.Has(kNpzRegionIds) && archive.Has(kNpzRegionNames)) {
    std::vector<int32_t> named;
    std::vector<std::string> names;
    absl::Status status = ReadTags(archive, file, kNpzRegionIds, named);
    if (status.ok()) {
      status = ReadNames(archive, file, kNpzRegionNames, names);
    }
    if (!status.ok()) {
      return status;
    }
    for (size_t i = 0; i < std::min(names.size(), named.size()); ++i) {
      collector.Name(named[i], names[i]);
    }
  }
  collector.MoveTo(mesh);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Mesh> ReadNpz(const std::string& path, const MeshNumbers& wanted) {
  const std::string& numbers = wanted.of_vertices;
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  const std::string name = file.name();
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<ZipReader> archive, ZipReader::Open(std::move(file)));
  WELLSPACE_ASSIGN_OR_RETURN(NpyReader points, OpenArray(*archive, name, kNpzPoints));
  const uint64_t vertices = points.rows();
  const uint64_t columns = points.columns();
  if (columns < kMinDimension || columns > kMaxDimension || vertices > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat(
        name, ": ", kNpzPoints, ": expected fewer than 2^32 rows and ", kMinDimension, " to ", kMaxDimension,
        " columns, a row for each point, got ", vertices, " rows and ", columns, " columns"));
  }
  Mesh mesh{.dimension = static_cast<int>(columns), .points = {}, .simplices = {}};
  WELLSPACE_RETURN_IF_ERROR(points.ReadNumbers(mesh.points));
  if (archive->Has(kNpzWeights)) {
    WELLSPACE_RETURN_IF_ERROR(ReadOfPoints(*archive, name, kNpzWeights, "weights", vertices, mesh.weights));
  }
  if (const std::string member = numbers + ".npy"; !numbers.empty() && archive->Has(member)) {
    WELLSPACE_RETURN_IF_ERROR(ReadOfPoints(*archive, name, member, "numbers", vertices, mesh.numbers));
  }
  if (!numbers.empty() && !archive->Has(kNpzSimplices)) {
    return mesh;
  }
  WELLSPACE_ASSIGN_OR_RETURN(NpyReader simplices, OpenArray(*archive, name, kNpzSimplices));
  if (simplices.columns() != columns + 1) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", kNpzSimplices, ": expected ", columns + 1,
                                                   " columns for simplices of points with ", columns,
                                                   " coordinates, got ", simplices.columns()));
  }
  WELLSPACE_RETURN_IF_ERROR(simplices.ReadIndices(vertices, mesh.simplices));
  if (archive->Has(kNpzRegions)) {
    WELLSPACE_RETURN_IF_ERROR(ReadRegions(*archive, name, mesh));
  }
  if (archive->Has(kNpzFacets)) {
    WELLSPACE_RETURN_IF_ERROR(ReadBoundary(*archive, name, mesh));
  }
  if (archive->Has(kNpzOrigins)) {
    WELLSPACE_RETURN_IF_ERROR(ReadOrigins(*archive, name, mesh));
  }
  if (archive->Has(kNpzRidges)) {
    WELLSPACE_RETURN_IF_ERROR(ReadRidges(*archive, name, mesh));
  }
  return mesh;
}

absl::Status ReadNpzPoints(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<ZipReader> archive, ZipReader::Open(std::move(file)));
  WELLSPACE_ASSIGN_OR_RETURN(NpyReader points, OpenArray(*archive, cloud.name, kNpzPoints));
  return ReadPointsOfArray(points, options, cloud);
}

}  // namespace wellspace::formats
