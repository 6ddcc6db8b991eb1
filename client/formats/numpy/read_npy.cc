// numpy's .npy: a cloud as one array, also that of an archive.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/input_file.h"
#include "client/formats/numpy/npy.h"
#include "client/formats/table_columns.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The columns of the array that are coordinates.
absl::StatusOr<std::vector<size_t>> ChooseColumns(const NpyReader& array, const CloudOptions& options,
                                                  const std::string& name) {
  const uint64_t count = array.columns();
  if (!options.columns.empty()) {
    absl::StatusOr<std::vector<size_t>> columns = ResolveColumns(options.columns, {}, count, options.dimension);
    return columns.ok() ? columns : absl::InvalidArgumentError(absl::StrCat(name, ": ", columns.status().message()));
  }
  const uint64_t wanted = options.dimension;
  if (wanted != 0 ? count != wanted : count < kMinDimension || count > kMaxDimension) {
    const bool has_more = count > (wanted != 0 ? wanted : kMaxDimension);
    return absl::InvalidArgumentError(absl::StrCat(
        name, ": expected ", wanted != 0 ? absl::StrCat(wanted) : absl::StrCat(kMinDimension, " to ", kMaxDimension),
        " coordinates, got an array of ", array.rows(), " rows and ", count, " columns",
        has_more ? absl::StrCat("; --columns ", wanted == 2 ? "1,2" : "1,2,3", " and the like take some of them")
                 : ""));
  }
  std::vector<size_t> columns(count);
  std::iota(columns.begin(), columns.end(), size_t{0});
  return columns;
}

}  // namespace

absl::Status ReadPointsOfArray(NpyReader& array, const CloudOptions& options, PointCloud& cloud) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<size_t> columns, ChooseColumns(array, options, cloud.name));
  WELLSPACE_RETURN_IF_ERROR(array.ReadNumbers(cloud.points));
  const uint64_t stride = array.columns();
  cloud.dimension = static_cast<int>(columns.size());
  // In place: a point never has more coordinates than its row.
  uint64_t kept = 0;
  for (uint64_t row = 0; row < array.rows(); ++row) {
    std::array<double, kMaxDimension> point;
    bool is_invalid = false;
    for (size_t axis = 0; axis < columns.size(); ++axis) {
      const double value = cloud.points[row * stride + columns[axis]];
      if (!std::isfinite(value) && !options.skip_invalid) {
        return absl::InvalidArgumentError(absl::StrCat(cloud.name, "[", row, "]: coordinate ", axis + 1,
                                                       ": expected a finite number, got ", value,
                                                       std::string(kSkipInvalidHint)));
      }
      is_invalid |= !std::isfinite(value);
      point[axis] = value;
    }
    if (is_invalid) {
      ++cloud.skipped;
      continue;
    }
    std::copy_n(point.begin(), columns.size(), cloud.points.begin() + kept * columns.size());
    ++kept;
    if (options.skip_invalid) {
      cloud.rows.Add(row);
    }
  }
  cloud.points.resize(kept * columns.size());
  return absl::OkStatus();
}

absl::Status ReadNpy(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  absl::StatusOr<NpyReader> array = NpyReader::Open(
      cloud.name, [&file](char* buffer, size_t size) { return file.Read(buffer, size); }, file.size());
  if (!array.ok()) {
    return array.status();
  }
  return ReadPointsOfArray(*array, options, cloud);
}

}  // namespace wellspace::formats
