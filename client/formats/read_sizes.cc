#include "client/formats/read_sizes.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/io/open_input.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/raster/raster_sizes.h"
#include "client/formats/registry.h"
#include "client/formats/sizes_between.h"
#include "client/formats/table_columns.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr char kSizes[] = "h";

bool IsSizeName(const std::string& name) {
  const std::string lower = absl::AsciiStrToLower(name);
  return lower == kSizes || lower == "size";
}

// Reads a table, row after row.
class SizeTable {
 public:
  SizeTable(LineReader& reader, int dimension, bool skip_invalid, SizedPoints& sized)
      : reader_(reader), dimension_(dimension), skip_invalid_(skip_invalid), sized_(sized) {}

  absl::Status Read() {
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return reader_.status();
    }
    const bool has_tab = line.find('\t') != std::string_view::npos;
    separator_ = SeparatorOf(line);
    separator_ = separator_ == ' ' && has_tab ? '\t' : separator_;
    WELLSPACE_ASSIGN_OR_RETURN(const bool is_header, TakeHeader(FieldsOf(line, separator_)));
    if (!is_header) {
      WELLSPACE_RETURN_IF_ERROR(ReadRow(FieldsOf(line, separator_)));
    }
    while (reader_.NextContent(line)) {
      WELLSPACE_RETURN_IF_ERROR(ReadRow(FieldsOf(line, separator_)));
    }
    return reader_.Finish();
  }

 private:
  // Chooses the columns; false if `names` are no names.
  absl::StatusOr<bool> TakeHeader(const std::vector<std::string>& names) {
    field_count_ = names.size();
    if (std::none_of(names.begin(), names.end(), IsColumnName)) {
      if (field_count_ != static_cast<size_t>(dimension_) + 1) {
        return reader_.Error(absl::StrCat("expected ", dimension_, " coordinates and a size, got ", field_count_,
                                          " columns; a header may name the columns"));
      }
      for (int k = 0; k < dimension_; ++k) {
        columns_.push_back(k);
      }
      size_column_ = dimension_;
      return false;
    }
    const auto size = std::find_if(names.begin(), names.end(), IsSizeName);
    if (size == names.end()) {
      return reader_.Error(absl::StrCat("no column is called \"", kSizes, "\" or \"size\""));
    }
    size_column_ = size - names.begin();
    std::vector<std::string> others = names;
    others[size_column_].clear();
    columns_ = FindCoordinates(others).columns;
    if (columns_.size() != static_cast<size_t>(dimension_) && names.size() == static_cast<size_t>(dimension_) + 1) {
      columns_.clear();
      for (size_t column = 0; column < names.size(); ++column) {
        if (column != size_column_) {
          columns_.push_back(column);
        }
      }
    }
    if (columns_.size() != static_cast<size_t>(dimension_)) {
      return reader_.Error(absl::StrCat("expected ", dimension_, " columns of coordinates beside \"", *size, "\", got ",
                                        columns_.size(), " with names of coordinates"));
    }
    return true;
  }

  absl::Status ReadRow(const std::vector<std::string>& fields) {
    if (fields.size() != field_count_) {
      return reader_.Error(absl::StrCat("expected ", field_count_, " fields, got ", fields.size()));
    }
    bool is_invalid = false;
    double value = 0;
    std::vector<double>& points = sized_.cloud.points;
    const size_t before = points.size();
    for (const size_t column : columns_) {
      WELLSPACE_RETURN_IF_ERROR(Take(fields[column], column, value, is_invalid));
      points.push_back(value);
    }
    WELLSPACE_RETURN_IF_ERROR(Take(fields[size_column_], size_column_, value, is_invalid));
    if (is_invalid) {
      points.resize(before);
      ++sized_.cloud.skipped;
      return absl::OkStatus();
    }
    sized_.sizes.push_back(value);
    sized_.cloud.lines.Add(reader_.line_number());
    return absl::OkStatus();
  }

  absl::Status Take(const std::string& field, size_t column, double& value, bool& is_invalid) const {
    const absl::Status status = TakeCoordinate(field, skip_invalid_, value, is_invalid);
    return status.ok() ? status : reader_.Error(absl::StrCat("column ", column + 1, ": ", status.message()));
  }

  LineReader& reader_;
  const int dimension_;
  const bool skip_invalid_;
  SizedPoints& sized_;
  char separator_ = ' ';
  size_t field_count_ = 0;
  std::vector<size_t> columns_;  // of the coordinates
  size_t size_column_ = 0;
};

absl::Status NoSimplices(const std::string& path) {
  return absl::InvalidArgumentError(
      absl::StrCat(path,
                   ": no simplices, between whose vertices sizes could be interpolated; expected a mesh, .vtu, .msh "
                   "or .npz with simplices"));
}

void NoteSkipped(SizedPoints& sized) {
  if (const uint64_t skipped = sized.cloud.skipped; skipped > 0) {
    sized.cloud.notes.push_back(absl::StrCat(sized.cloud.name, ": ", skipped, skipped == 1 ? " size is" : " sizes are",
                                             " left out, which or a coordinate of which is missing or not finite"));
  }
}

absl::Status ReadTable(const std::string& path, int dimension, const SizeOptions& options, SizedPoints& sized) {
  if (options.growth_to_interpolate.has_value()) {
    return NoSimplices(path);
  }
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  sized.cloud.name = file.name();
  LineReader reader(std::move(file));
  WELLSPACE_RETURN_IF_ERROR(SizeTable(reader, dimension, options.skip_invalid, sized).Read());
  NoteSkipped(sized);
  return absl::OkStatus();
}

// Adds sizes between the vertices of `simplices`. Those with a size that is none are for the caller to see.
absl::Status Interpolate(std::span<const uint32_t> simplices, const SizeOptions& options, SizedPoints& sized) {
  SizesBetween between{.dimension = sized.cloud.dimension,
                       .points = std::exchange(sized.cloud.points, {}),
                       .sizes = std::exchange(sized.sizes, {}),
                       .rows = {}};
  const size_t given = between.sizes.size();
  between.rows.resize(given);
  std::iota(between.rows.begin(), between.rows.end(), 0);
  std::vector<bool> is_left_out(given);
  for (size_t i = 0; i < given; ++i) {
    is_left_out[i] = !(between.sizes[i] > 0 && std::isfinite(between.sizes[i]));
  }
  if (absl::Status status =
          AddSizesBetween(simplices, is_left_out, *options.growth_to_interpolate, options.radius_of_size, between);
      !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(sized.cloud.name, ": ", status.message()));
  }
  sized.cloud.points = std::move(between.points);
  sized.sizes = std::move(between.sizes);
  for (const uint64_t row : between.rows) {
    sized.cloud.rows.Add(row);
  }
  if (const size_t added = sized.sizes.size() - given; added > 0) {
    sized.cloud.notes.push_back(absl::StrCat(sized.cloud.name, ": ", added,
                                             " sizes are added between those of the vertices, to interpolate them"));
  }
  return absl::OkStatus();
}

// Leaves out points whose size or coordinates are not finite.
void LeaveOutInvalid(SizedPoints& sized) {
  PointCloud& cloud = sized.cloud;
  const auto dimension = static_cast<size_t>(cloud.dimension);
  size_t kept = 0;
  std::vector<uint64_t> rows;
  for (size_t i = 0; i < sized.sizes.size(); ++i) {
    const auto row = cloud.points.begin() + static_cast<std::ptrdiff_t>(i * dimension);
    const auto end = row + static_cast<std::ptrdiff_t>(dimension);
    if (!std::isfinite(sized.sizes[i]) || !std::all_of(row, end, [](double x) { return std::isfinite(x); })) {
      continue;
    }
    std::copy(row, end, cloud.points.begin() + static_cast<std::ptrdiff_t>(kept * dimension));
    sized.sizes[kept++] = sized.sizes[i];
    rows.push_back(cloud.rows.size() > 0 ? cloud.rows.LineOf(i) : i);
  }
  cloud.skipped = sized.sizes.size() - kept;
  sized.sizes.resize(kept);
  cloud.points.resize(kept * dimension);
  if (cloud.skipped > 0) {
    cloud.rows = {};
    for (const uint64_t row : rows) {
      cloud.rows.Add(row);
    }
  }
}

using NumbersReader = absl::StatusOr<Mesh> (*)(const std::string&, const MeshNumbers&);

template <NumbersReader kReader>
absl::Status ReadOfMesh(const std::string& path, int dimension, const SizeOptions& options, SizedPoints& sized) {
  WELLSPACE_ASSIGN_OR_RETURN(Mesh mesh, kReader(path, {.of_vertices = kSizes}));
  sized.cloud.name = path;
  if (mesh.numbers.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": no data of its points are called \"", kSizes, "\"; their sizes are expected there"));
  }
  if (mesh.dimension != dimension) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": expected points in ", dimension, "-D, got ", mesh.dimension, "-D"));
  }
  sized.cloud.points = std::move(mesh.points);
  sized.sizes = std::move(mesh.numbers);
  if (options.growth_to_interpolate.has_value()) {
    if (mesh.simplices.empty()) {
      return NoSimplices(path);
    }
    WELLSPACE_RETURN_IF_ERROR(Interpolate(mesh.simplices, options, sized));
  }
  if (options.skip_invalid) {
    LeaveOutInvalid(sized);
    NoteSkipped(sized);
  }
  return absl::OkStatus();
}

using RasterReader = absl::Status (*)(const std::string&, SizedPoints&);

template <RasterReader kReader>
absl::Status ReadRaster(const std::string& path, int dimension, const SizeOptions& options, SizedPoints& sized) {
  if (dimension != 2) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": a raster has sizes in the plane; expected those of a mesh in ", dimension, "-D"));
  }
  return options.growth_to_interpolate.has_value() ? NoSimplices(path) : kReader(path, sized);
}

using SizeReader = absl::Status (*)(const std::string&, int, const SizeOptions&, SizedPoints&);

std::span<const Format<SizeReader>> SizeReaders() {
  static const std::vector<Format<SizeReader>> readers = {
      {"csv", {".csv", ".tsv", ".txt", ".dat"}, ReadTable},
      {"vtu", {".vtu"}, ReadOfMesh<ReadVtu>},
      {"msh", {".msh"}, ReadOfMesh<ReadMsh>},
      {"npz", {".npz"}, ReadOfMesh<ReadNpz>},
      {"esri", {".asc"}, ReadRaster<ReadEsriGrid>},
      {"geotiff", {".tif", ".tiff"}, ReadRaster<ReadGeoTiff>},
  };
  return readers;
}

}  // namespace

absl::StatusOr<SizedPoints> ReadSizes(const std::string& path, int dimension, const SizeOptions& options) {
  WELLSPACE_ASSIGN_OR_RETURN(const Format<SizeReader>* format, FindFormat(SizeReaders(), WithoutGzip(path), ""));
  SizedPoints sized;
  sized.cloud.dimension = dimension;
  WELLSPACE_RETURN_IF_ERROR(format->handler(path, dimension, options, sized));
  if (sized.sizes.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(sized.cloud.name, ": no sizes; expected at least one"));
  }
  for (size_t i = 0; i < sized.sizes.size(); ++i) {
    if (!(sized.sizes[i] > 0 && std::isfinite(sized.sizes[i]))) {
      return absl::InvalidArgumentError(
          absl::StrCat(sized.cloud.Origin(i), ": size ", sized.sizes[i], " is not allowed; a number above 0 is"));
    }
  }
  return sized;
}

}  // namespace wellspace::formats
