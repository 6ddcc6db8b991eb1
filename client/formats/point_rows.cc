#include "client/formats/point_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/table_columns.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The columns that are called x, y and z; the last may be missing.
absl::StatusOr<std::vector<size_t>> ColumnsOfAxes(const std::vector<std::string>& names, int dimension) {
  std::vector<size_t> columns;
  for (const char axis : {'x', 'y', 'z'}) {
    const auto is_axis = [axis](const std::string& name) {
      return name.size() == 1 && absl::ascii_tolower(static_cast<unsigned char>(name[0])) == axis;
    };
    const auto count = std::count_if(names.begin(), names.end(), is_axis);
    if (count > 1 || (count == 0 && axis != 'z')) {
      return absl::InvalidArgumentError("expected one x, one y and at most one z; --columns takes others");
    }
    if (count == 1) {
      columns.push_back(std::find_if(names.begin(), names.end(), is_axis) - names.begin());
    }
  }
  if (dimension != 0 && columns.size() != static_cast<size_t>(dimension)) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected ", dimension, " coordinates, got ", columns.size(),
                     static_cast<size_t>(dimension) < columns.size()  ? "; --columns x,y takes 2 of them"
                     : static_cast<size_t>(dimension) <= names.size() ? "; --columns takes others"
                                                                      : ""));
  }
  return columns;
}

}  // namespace

absl::StatusOr<PointRows> PointRows::Create(const std::vector<std::string>& names, const CloudOptions& options,
                                            PointCloud& cloud) {
  PointRows rows(options.skip_invalid, cloud);
  WELLSPACE_ASSIGN_OR_RETURN(rows.coordinates_,
                             options.columns.empty()
                                 ? ColumnsOfAxes(names, options.dimension)
                                 : ResolveColumns(options.columns, names, names.size(), options.dimension));
  cloud.dimension = static_cast<int>(rows.coordinates_.size());
  for (size_t column = 0; column < names.size() && options.keep_attributes; ++column) {
    const auto end = rows.coordinates_.end();
    if (std::find(rows.coordinates_.begin(), end, column) == end) {
      rows.attributes_.push_back(column);
      cloud.attributes.push_back({.name = names[column], .values = {}});
    }
  }
  return rows;
}

absl::StatusOr<bool> PointRows::Add(std::span<const double> row) {
  std::array<double, kMaxDimension> point;
  bool is_invalid = false;
  for (size_t axis = 0; axis < coordinates_.size(); ++axis) {
    point[axis] = row[coordinates_[axis]];
    if (!std::isfinite(point[axis]) && !skips_invalid_) {
      return absl::InvalidArgumentError(absl::StrCat("coordinate ", axis + 1, ": expected a finite number, got ",
                                                     point[axis], std::string(kSkipInvalidHint)));
    }
    is_invalid |= !std::isfinite(point[axis]);
  }
  if (is_invalid) {
    ++cloud_->skipped;
    return false;
  }
  cloud_->points.insert(cloud_->points.end(), point.begin(), point.begin() + coordinates_.size());
  for (size_t i = 0; i < attributes_.size(); ++i) {
    cloud_->attributes[i].values.push_back(row[attributes_[i]]);
  }
  return true;
}

std::vector<std::string> ComponentNames(const std::string& name, uint64_t components) {
  if (components == 1) {
    return {name};
  }
  std::vector<std::string> names;
  for (uint64_t i = 0; i < components; ++i) {
    names.push_back(absl::StrCat(name, ":", i));
  }
  return names;
}

std::vector<std::string> DataNames(const std::string& name, uint64_t components) {
  const bool is_axis = name.size() == 1 && std::string_view("xyzXYZ").find(name[0]) != std::string_view::npos;
  return components == 1 && is_axis ? std::vector<std::string>{absl::StrCat(name, ":0")}
                                    : ComponentNames(name, components);
}

absl::Status AddAllRows(const std::vector<std::string>& names, std::span<const std::vector<double>> columns,
                        const CloudOptions& options, PointCloud& cloud) {
  absl::StatusOr<PointRows> rows = PointRows::Create(names, options, cloud);
  if (!rows.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(cloud.name, ": ", rows.status().message()));
  }
  std::vector<double> row(names.size());
  for (uint64_t point = 0; point < columns[0].size(); ++point) {
    for (size_t column = 0; column < columns.size(); ++column) {
      row[column] = columns[column][point];
    }
    const absl::StatusOr<bool> is_added = rows->Add(row);
    if (!is_added.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(cloud.name, "[", point, "]: ", is_added.status().message()));
    }
    if (*is_added && options.skip_invalid) {
      cloud.rows.Add(point);
    }
  }
  return absl::OkStatus();
}

std::vector<std::vector<double>> ColumnsOf(std::span<const double> numbers, size_t width) {
  std::vector<std::vector<double>> columns(width);
  for (size_t i = 0; i < numbers.size(); ++i) {
    columns[i % width].push_back(numbers[i]);
  }
  return columns;
}

absl::Status AddAllPoints(std::span<const double> points, size_t width, const CloudOptions& options,
                          PointCloud& cloud) {
  const std::vector<std::string> names = {"x", "y", "z"};
  return AddAllRows({names.begin(), names.begin() + static_cast<ptrdiff_t>(width)}, ColumnsOf(points, width), options,
                    cloud);
}

}  // namespace wellspace::formats
