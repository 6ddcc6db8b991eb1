#include "core/validate/validate_sizes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "absl/strings/str_format.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/point.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

constexpr double kRelativeTolerance = 1e-9;

template <typename... Args>
absl::Status Refuse(const absl::FormatSpec<Args...>& format, const Args&... args) {
  return absl::InvalidArgumentError(absl::StrFormat(format, args...));
}

absl::Status CheckBox(const SizeBox& box, size_t b, int dimension) {
  const auto d = static_cast<size_t>(dimension);
  if (box.low.size() != d || box.high.size() != d) {
    return Refuse("size box %d has corners of %d and %d coordinates; %d are needed", b, box.low.size(), box.high.size(),
                  dimension);
  }
  for (size_t k = 0; k < d; ++k) {
    if (!(std::isfinite(box.low[k]) && std::isfinite(box.high[k]) && box.low[k] <= box.high[k])) {
      return Refuse("size box %d reaches from %g to %g on axis %d; finite numbers in ascending order are needed", b,
                    box.low[k], box.high[k], k);
    }
  }
  return box.max_circumradius > 0 && std::isfinite(box.max_circumradius)
             ? absl::OkStatus()
             : Refuse("size box %d: max_circumradius is %g; a positive, finite number is needed", b,
                      box.max_circumradius);
}

absl::Status CheckSamples(const SizeSamples& samples, int dimension) {
  if (samples.points.size() != samples.sizes.size() * dimension) {
    return Refuse("%d sizes are at points of %d coordinates; %d for each are needed", samples.sizes.size(),
                  samples.points.size(), dimension);
  }
  for (size_t i = 0; i < samples.points.size(); ++i) {
    if (!std::isfinite(samples.points[i])) {
      return Refuse("size at point %d: coordinate %d is %g; it has to be finite", i / dimension, i % dimension,
                    samples.points[i]);
    }
  }
  for (size_t i = 0; i < samples.sizes.size(); ++i) {
    if (!(samples.sizes[i] > 0 && std::isfinite(samples.sizes[i]))) {
      return Refuse("size at point %d is %g; a positive, finite number is needed", i, samples.sizes[i]);
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckSizeBounds(const SizeBounds& bounds, int dimension) {
  if (!(bounds.max_circumradius >= 0 && std::isfinite(bounds.max_circumradius))) {
    return Refuse("max_circumradius is %g; a finite number, 0 or more, is needed", bounds.max_circumradius);
  }
  if (!(bounds.gradation >= 0 && bounds.gradation <= 1)) {
    return Refuse("gradation is %g; a number from 0 to 1 is needed", bounds.gradation);
  }
  for (size_t b = 0; b < bounds.boxes.size(); ++b) {
    WELLSPACE_RETURN_IF_ERROR(CheckBox(bounds.boxes[b], b, dimension));
  }
  return bounds.samples == nullptr ? absl::OkStatus() : CheckSamples(*bounds.samples, dimension);
}

template <int D>
std::string SizeExcess(const std::array<Point<D>, D + 1>& corners, const SizeBounds& bounds) {
  const Point<D> offset = CircumcentreOffset<D>(corners);
  const double radius = Distance<D>(offset, Point<D>{});
  const auto keeps = [radius](double bound) { return radius <= bound * (1 + kRelativeTolerance); };
  if (bounds.max_circumradius > 0 && !keeps(bounds.max_circumradius)) {
    return absl::StrFormat("circumradius %.17g, more than %.17g", radius, bounds.max_circumradius);
  }
  // Distances are taken relative to the corner, so that they have an error in proportion to themselves and the radius.
  const double from_boxes = bounds.gradation == 0 ? 1 : bounds.gradation;
  for (size_t b = 0; b < bounds.boxes.size(); ++b) {
    const SizeBox& box = bounds.boxes[b];
    Point<D> gap;
    for (int k = 0; k < D; ++k) {
      gap[k] = std::max({box.low[k] - corners[0][k] - offset[k], 0.0, offset[k] - (box.high[k] - corners[0][k])});
    }
    const double distance = Distance<D>(gap, Point<D>{});
    if (!keeps(std::max(box.max_circumradius, from_boxes * distance))) {
      return absl::StrFormat("circumradius %.17g, more than the %.17g of size box %d, at a distance of %.17g from it",
                             radius, box.max_circumradius, b, distance);
    }
  }
  const double from_samples = bounds.gradation == 0 ? kDefaultSampleGradation : bounds.gradation;
  const size_t samples = bounds.samples == nullptr ? 0 : bounds.samples->sizes.size();
  for (size_t i = 0; i < samples; ++i) {
    const double given = bounds.samples->sizes[i];
    const double size = bounds.samples->measure == SizeMeasure::kEdgeLength ? CircumradiusOf(given, D) : given;
    if (radius <= size) {
      continue;
    }
    const Point<D> p = PointAt<D>(bounds.samples->points, i);
    Point<D> gap;
    for (int k = 0; k < D; ++k) {
      gap[k] = p[k] - corners[0][k] - offset[k];
    }
    const double distance = Distance<D>(gap, Point<D>{});
    if (!keeps(size + from_samples * distance)) {
      return absl::StrFormat(
          "circumradius %.17g, more than the %.17g of the size at point %d, at a distance of %.17g from it", radius,
          size, i, distance);
    }
  }
  return "";
}

#define WELLSPACE_INSTANTIATE(D) \
  template std::string SizeExcess<D>(const std::array<Point<D>, D + 1>&, const SizeBounds&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
