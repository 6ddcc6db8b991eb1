#include "client/formats/surface/surface_builder.h"

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"
#include "client/formats/surface/cut_polygon.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

absl::Status SurfaceBuilder::AddPolygon(std::span<const uint32_t> corners, int32_t marker, uint64_t place) {
  if (corners.size() < 3) {
    return absl::InvalidArgumentError(absl::StrCat("expected a face of at least 3 corners, got ", corners.size()));
  }
  if (corners.size() == 3) {
    surface_.corners.insert(surface_.corners.end(), corners.begin(), corners.end());
  } else {
    WELLSPACE_RETURN_IF_ERROR(CutPolygon(surface_.points, corners, surface_.corners));
    ++surface_.cut_polygons;
  }
  if (surface_.triangle_count() > kMaxCount) {
    return absl::InvalidArgumentError(absl::StrCat("expected at most ", kMaxCount, " triangles, got more"));
  }
  while (surface_.markers.size() < surface_.triangle_count()) {
    surface_.markers.push_back(marker);
    surface_.places.front().triangles.Add(place);
  }
  return absl::OkStatus();
}

int32_t SurfaceBuilder::MarkerOf(std::string_view name) {
  if (name.empty()) {
    return 0;
  }
  const auto at = marker_of_.find(name);
  if (at != marker_of_.end()) {
    return at->second;
  }
  const auto marker = static_cast<int32_t>(marker_of_.size() + 1);
  marker_of_.emplace(name, marker);
  surface_.parts.push_back({marker, std::string(name)});
  return marker;
}

}  // namespace wellspace::formats
