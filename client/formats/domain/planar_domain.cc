#include "client/formats/domain/planar_domain.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

// The last place whose `first` is not above `index`. Of those that begin with the same one it is the one that has it.
const GeoJsonPlace& PlaceOf(const std::vector<GeoJsonPlace>& places, uint64_t GeoJsonPlace::*first, uint64_t index) {
  const auto after = std::upper_bound(places.begin(), places.end(), index,
                                      [first](uint64_t wanted, const GeoJsonPlace& p) { return wanted < p.*first; });
  return *std::prev(after);
}

void AppendIndex(uint32_t index, std::string& path) {
  if (index != GeoJsonPlace::kNone) {
    absl::StrAppend(&path, "[", index, "]");
  }
}

}  // namespace

std::string PathOf(const GeoJsonPlace& place, const std::vector<std::string>& collections) {
  std::string path;
  if (place.feature != GeoJsonPlace::kNone) {
    absl::StrAppend(&path, "features[", place.feature, "].");
  }
  if (place.is_feature) {
    path += "geometry.";
  }
  if (place.collection != GeoJsonPlace::kNone) {
    path += collections[place.collection];
  }
  path += "coordinates";
  AppendIndex(place.part, path);
  AppendIndex(place.ring, path);
  return path;
}

std::string PlanarDomain::PointOrigin(uint64_t point) const {
  if (places.empty()) {
    return absl::StrCat(points_name.empty() ? name : points_name, ":", point_lines.LineOf(point));
  }
  const GeoJsonPlace& place = PlaceOf(places, &GeoJsonPlace::first_point, point);
  const std::string path = PathOf(place, collections);
  return absl::StrCat(name, ":", place.line, ": ", path,
                      place.has_index ? absl::StrCat("[", point_lines.LineOf(point), "]") : "");
}

std::string PlanarDomain::SegmentOrigin(uint64_t segment) const {
  if (places.empty()) {
    return absl::StrCat(name, ":", segment_lines.LineOf(segment));
  }
  // The points of a ring or a line follow each other, and each segment begins where the one before ends.
  const GeoJsonPlace& place = PlaceOf(places, &GeoJsonPlace::first_segment, segment);
  return PointOrigin(place.first_point + (segment - place.first_segment));
}

std::string PlanarDomain::SeedOrigin(uint64_t seed) const {
  if (places.empty()) {
    return absl::StrCat(name, ":", seed_lines.LineOf(seed));
  }
  const GeoJsonPlace& place = places[seed_places[seed]];
  return absl::StrCat(name, ":", place.line, ": ", PathOf(place, collections));
}

}  // namespace wellspace::formats
