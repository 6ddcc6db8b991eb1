#include "client/formats/read_sizes.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/io/open_input.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/raster/raster_sizes.h"
#include "client/formats/registry.h"
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
  SizeTable(LineReader& reader, int dimension, SizedPoints& sized)
      : reader_(reader), dimension_(dimension), sized_(sized) {}

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
    double value = 0;
    for (const size_t column : columns_) {
      WELLSPACE_RETURN_IF_ERROR(Take(fields[column], column, value));
      sized_.cloud.points.push_back(value);
    }
    WELLSPACE_RETURN_IF_ERROR(Take(fields[size_column_], size_column_, value));
    sized_.sizes.push_back(value);
    sized_.cloud.lines.Add(reader_.line_number());
    return absl::OkStatus();
  }

  absl::Status Take(const std::string& field, size_t column, double& value) const {
    const absl::Status status = TakeFinite(field, value);
    return status.ok() ? status : reader_.Error(absl::StrCat("column ", column + 1, ": ", status.message()));
  }

  LineReader& reader_;
  const int dimension_;
  SizedPoints& sized_;
  char separator_ = ' ';
  size_t field_count_ = 0;
  std::vector<size_t> columns_;  // of the coordinates
  size_t size_column_ = 0;
};

absl::Status ReadTable(const std::string& path, int dimension, SizedPoints& sized) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  sized.cloud.name = file.name();
  LineReader reader(std::move(file));
  return SizeTable(reader, dimension, sized).Read();
}

using NumbersReader = absl::StatusOr<Mesh> (*)(const std::string&, const std::string&);

template <NumbersReader kReader>
absl::Status ReadOfMesh(const std::string& path, int dimension, SizedPoints& sized) {
  WELLSPACE_ASSIGN_OR_RETURN(Mesh mesh, kReader(path, kSizes));
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
  return absl::OkStatus();
}

using RasterReader = absl::Status (*)(const std::string&, SizedPoints&);

template <RasterReader kReader>
absl::Status ReadRaster(const std::string& path, int dimension, SizedPoints& sized) {
  return dimension == 2
             ? kReader(path, sized)
             : absl::InvalidArgumentError(absl::StrCat(
                   path, ": a raster has sizes in the plane; expected those of a mesh in ", dimension, "-D"));
}

using SizeReader = absl::Status (*)(const std::string&, int, SizedPoints&);

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

absl::StatusOr<SizedPoints> ReadSizes(const std::string& path, int dimension) {
  WELLSPACE_ASSIGN_OR_RETURN(const Format<SizeReader>* format, FindFormat(SizeReaders(), WithoutGzip(path), ""));
  SizedPoints sized;
  sized.cloud.dimension = dimension;
  WELLSPACE_RETURN_IF_ERROR(format->handler(path, dimension, sized));
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
