#include "core/input/point_images.h"

#include <numeric>

#include "absl/strings/str_cat.h"
#include "core/base/check_at.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/point.h"

namespace wellspace::core {

std::vector<uint32_t> PointsWithImages::Names(std::span<const uint32_t> inputs) const {
  std::vector<uint32_t> names(inputs.begin(), inputs.end());
  if (names.empty()) {
    names.resize(given);
    std::iota(names.begin(), names.end(), uint32_t{0});
  }
  for (const uint32_t source : sources) {
    names.push_back(names[source]);
  }
  return names;
}

template <int D>
absl::StatusOr<PointsWithImages> WithImages(const PeriodicBox<D>& box, std::span<const double> points,
                                            const RunContext& context) {
  PointsWithImages result;
  if (!box.HasAxes()) {
    return result;
  }
  std::vector<double> images;
  for (uint32_t i = 0; i < points.size() / D; ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    box.ForEachImage(PointAt<D>(points, i), [&](const Point<D>& image) {
      images.insert(images.end(), image.begin(), image.end());
      result.sources.push_back(i);
    });
  }
  if (result.HasImages()) {
    result.given = points.size() / D;
    result.points.reserve(points.size() + images.size());
    result.points.assign(points.begin(), points.end());
    result.points.insert(result.points.end(), images.begin(), images.end());
  }
  return result;
}

template <int D>
size_t CountImages(const PeriodicBox<D>& box, std::span<const double> points) {
  size_t count = 0;
  for (size_t i = 0; box.HasAxes() && i < points.size() / D; ++i) {
    box.ForEachImage(PointAt<D>(points, i), [&](const Point<D>& /*image*/) { ++count; });
  }
  return count;
}

absl::Status ExplainImages(const absl::Status& status) {
  absl::Status explained(status.code(),
                         absl::StrCat(status.message(),
                                      "; the image of a point across a periodic box counts as a point, and points "
                                      "are not merged with images: give both sides the same coordinates along them"));
  status.ForEachPayload([&](absl::string_view url, const absl::Cord& payload) { explained.SetPayload(url, payload); });
  return explained;
}

#define WELLSPACE_INSTANTIATE(D)                                                                          \
  template absl::StatusOr<PointsWithImages> WithImages<D>(const PeriodicBox<D>&, std::span<const double>, \
                                                          const RunContext&);                             \
  template size_t CountImages<D>(const PeriodicBox<D>&, std::span<const double>);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
