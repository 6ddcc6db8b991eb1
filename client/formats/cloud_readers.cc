#include "client/formats/cloud_readers.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/number.h"
#include "client/formats/table_columns.h"

namespace wellspace::formats {
namespace {

void NoteUnused(uint64_t count, const char* what, PointCloud& cloud) {
  if (count > 0) {
    cloud.notes.push_back(
        absl::StrCat(cloud.name, ": ", count, " ", what, count == 1 ? " is" : "s are", " not used, only the points"));
  }
}

}  // namespace

absl::Status TakeCoordinate(std::string_view text, bool skip_invalid, double& value, bool& is_invalid) {
  switch (ReadCoordinate(text, value)) {
    case CoordinateKind::kFinite:
      return absl::OkStatus();
    case CoordinateKind::kInvalid:
      if (skip_invalid) {
        is_invalid = true;
        return absl::OkStatus();
      }
      break;
    case CoordinateKind::kNone:
      break;
  }
  return CoordinateError(text);
}

absl::Status TakeCoordinate(std::string_view text, InvalidValue rule, double& value, bool& is_invalid) {
  return rule == InvalidValue::kRefuse ? TakeFinite(text, value)
                                       : TakeCoordinate(text, rule == InvalidValue::kSkip, value, is_invalid);
}

void AddPoint(std::span<const double> point, bool is_invalid, uint64_t line, PointCloud& cloud) {
  if (is_invalid) {
    ++cloud.skipped;
    return;
  }
  cloud.points.insert(cloud.points.end(), point.begin(), point.end());
  cloud.lines.Add(line);
}

std::string DimensionError(int wanted, uint64_t count) {
  if (wanted == 0) {
    return absl::StrCat("expected ", kMinDimension, " to ", kMaxDimension, " coordinates, got ", count);
  }
  std::string columns;
  for (int column = 1; column <= wanted; ++column) {
    absl::StrAppend(&columns, column == 1 ? "" : ",", column);
  }
  return absl::StrCat("expected ", wanted, " coordinates, got ", count,
                      count > static_cast<uint64_t>(wanted)
                          ? absl::StrCat("; --columns ", columns, " takes ", wanted, " of them")
                          : "");
}

void NoteFaces(uint64_t faces, PointCloud& cloud) { NoteUnused(faces, "face", cloud); }

void NoteCells(uint64_t cells, PointCloud& cloud) { NoteUnused(cells, "cell", cloud); }

absl::Status TakeColumns(const CloudOptions& options, PointCloud& cloud) {
  const size_t count = cloud.dimension;
  std::vector<std::string> names;
  for (const char* name : {"x", "y", "z"}) {
    if (count <= 3 && names.size() < count) {
      names.emplace_back(name);
    }
  }
  const absl::StatusOr<std::vector<size_t>> columns = ResolveColumns(options.columns, names, count, options.dimension);
  if (!columns.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(cloud.name, ": ", columns.status().message()));
  }
  std::vector<double> taken;
  taken.reserve(cloud.size() * columns->size());
  for (size_t at = 0; at < cloud.points.size(); at += count) {
    for (const size_t column : *columns) {
      taken.push_back(cloud.points[at + column]);
    }
  }
  cloud.points = std::move(taken);
  cloud.dimension = static_cast<int>(columns->size());
  return absl::OkStatus();
}

}  // namespace wellspace::formats
