#include "client/formats/raster/raster_sizes.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {

void RasterSizes::Add(double value) {
  const uint64_t cell = cells_++;
  if (std::isnan(value) || value == nodata_) {
    ++sized_.cloud.skipped;
    return;
  }
  const auto column = static_cast<double>(cell % frame_.columns);
  const auto row = static_cast<double>(cell / frame_.columns);
  sized_.cloud.points.push_back(frame_.x + column * frame_.width);
  sized_.cloud.points.push_back(frame_.y - row * frame_.height);
  sized_.cloud.rows.Add(cell);
  sized_.sizes.push_back(value);
}

void RasterSizes::Finish() {
  if (const uint64_t skipped = sized_.cloud.skipped; skipped > 0) {
    sized_.cloud.notes.push_back(absl::StrCat(sized_.cloud.name, ": ", skipped, " of ", cells_,
                                              " cells of the raster have no data, and no size"));
  }
}

absl::Status CheckFrame(const std::string& name, const RasterFrame& frame) {
  if (frame.columns == 0 || frame.rows == 0 || frame.columns > kMaxCount / frame.rows) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": expected fewer than 2^32 cells, at least one, got ",
                                                   frame.columns, " columns and ", frame.rows, " rows"));
  }
  const double right = frame.x + static_cast<double>(frame.columns) * frame.width;
  const double bottom = frame.y - static_cast<double>(frame.rows) * frame.height;
  if (!(frame.width > 0 && frame.height > 0 && std::isfinite(right) && std::isfinite(bottom))) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": expected cells with a width and a height above 0, got ",
                                                   frame.width, " and ", frame.height));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
