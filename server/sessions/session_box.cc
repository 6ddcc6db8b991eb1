#include "server/sessions/session_box.h"

#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

std::string RangeOf(const SessionBox& box, int axis) {
  return absl::StrCat("in the domain it is from ", box.low[axis], " to ", box.high[axis]);
}

// Not for NaN, which is nowhere.
bool IsWithin(const SessionBox& box, int axis, double x) { return x >= box.low[axis] && x <= box.high[axis]; }

}  // namespace

absl::Status CheckPoints(const SessionBox& box, int dimension, uint64_t first, std::span<const double> coordinates) {
  int axis = 0;
  for (size_t i = 0; i < coordinates.size(); ++i) {
    const double x = coordinates[i];
    if (!(box.IsOpen() ? std::isfinite(x) : IsWithin(box, axis, x))) {
      return MakeError(v1::ERROR_REASON_INVALID_POINTS,
                       absl::StrCat("points[", first + i / dimension, "]: coordinate ", axis, " is ", x, "; ",
                                    box.IsOpen() ? "a finite number is needed" : RangeOf(box, axis)),
                       "points.coordinates");
    }
    axis = axis + 1 == dimension ? 0 : axis + 1;
  }
  return absl::OkStatus();
}

absl::Status CheckSamples(const SessionBox& box, int dimension, const core::SizeSamples& samples) {
  for (size_t i = 0; !box.IsOpen() && i < samples.points.size(); ++i) {
    const int axis = static_cast<int>(i % dimension);
    if (!IsWithin(box, axis, samples.points[i])) {
      return MakeError(v1::ERROR_REASON_INVALID_SIZES,
                       absl::StrCat("samples.points[", i / dimension, "]: coordinate ", axis, " is ", samples.points[i],
                                    "; ", RangeOf(box, axis)),
                       "samples.points");
    }
  }
  return absl::OkStatus();
}

}  // namespace wellspace::server
