// numpy's .npy: a cloud as one array.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/npy.h"

namespace wellspace::formats {

absl::Status ReadNpy(InputFile& file, int dimension, PointCloud& cloud) {
  absl::StatusOr<NpyReader> array = NpyReader::Open(
      cloud.name, [&file](char* buffer, size_t size) { return file.Read(buffer, size); }, file.size());
  if (!array.ok()) {
    return array.status();
  }
  const uint64_t columns = array->columns();
  if (dimension != 0 ? columns != static_cast<uint64_t>(dimension)
                     : columns < kMinDimension || columns > kMaxDimension) {
    return absl::InvalidArgumentError(
        absl::StrCat(cloud.name, ": expected ",
                     dimension != 0 ? absl::StrCat(dimension) : absl::StrCat(kMinDimension, " to ", kMaxDimension),
                     " coordinates, got an array of ", array->rows(), " rows and ", columns, " columns"));
  }
  cloud.dimension = static_cast<int>(columns);
  if (absl::Status status = array->ReadNumbers(cloud.points); !status.ok()) {
    return status;
  }
  const auto bad = std::find_if(cloud.points.begin(), cloud.points.end(), [](double x) { return !std::isfinite(x); });
  if (bad != cloud.points.end()) {
    const uint64_t index = bad - cloud.points.begin();
    return absl::InvalidArgumentError(absl::StrCat(cloud.Origin(index / columns), ": coordinate ", index % columns + 1,
                                                   ": expected a finite number, got ", *bad));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
