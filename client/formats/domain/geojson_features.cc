#include "client/formats/domain/geojson_features.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/domain/interior_point.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

absl::StatusOr<int32_t> GeoJsonFeatures::NumberOf(const Value& value, Names& names,
                                                  std::map<int32_t, std::string>& of_domain) {
  if (names.has_numbers) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected a number, as features before have it, got ", std::string(value.text)));
  }
  if (value.string->empty()) {
    return 0;
  }
  const auto [found, is_new] = names.numbers.try_emplace(*value.string, static_cast<int32_t>(names.numbers.size() + 1));
  if (is_new) {
    of_domain.emplace(found->second, found->first);
  }
  return found->second;
}

absl::Status GeoJsonFeatures::TakeProperty(GeoJsonLevel& feature, const std::string& name, const Value& value) {
  const double* const number = value.number;
  if (number == nullptr && value.string == nullptr && value.text == "null") {
    return absl::OkStatus();
  }
  const auto refuse = [&](const char* expected, const Names& names) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected ", names.numbers.empty() ? expected : "a string", ", got ", std::string(value.text)));
  };
  if (!options_.region_property.empty() && name == options_.region_property) {
    if (value.string != nullptr) {
      WELLSPACE_ASSIGN_OR_RETURN(const int32_t region, NumberOf(value, regions_, domain_.region_names));
      feature.region = region > 0 ? std::optional<double>(region) : std::nullopt;
    } else if (number == nullptr || !regions_.numbers.empty()) {
      return refuse("a number, or a string, for the attribute of the region", regions_);
    } else {
      regions_.has_numbers = true;
      feature.region = *number;
    }
  }
  if (!options_.marker_property.empty() && name == options_.marker_property) {
    constexpr double kLimit = 2147483648.0;
    if (value.string != nullptr) {
      WELLSPACE_ASSIGN_OR_RETURN(feature.marker, NumberOf(value, markers_, domain_.marker_names));
    } else if (number == nullptr || *number != std::floor(*number) || *number < -kLimit || *number >= kLimit ||
               !markers_.numbers.empty()) {
      return refuse("a whole number from -2^31 to below 2^31, or a string, for the marker", markers_);
    } else {
      markers_.has_numbers = true;
      feature.marker = static_cast<int32_t>(*number);
    }
  }
  return absl::OkStatus();
}

void GeoJsonFeatures::End(const GeoJsonLevel& feature) {
  const uint64_t segments = domain_.segment_count();
  if (feature.marker) {
    domain_.markers.resize(feature.first_segment);
    domain_.markers.resize(segments, *feature.marker);
  }
  domain_.groups.resize(feature.first_segment);
  domain_.groups.resize(segments, static_cast<uint32_t>(feature.first_segment));
  without_marker_ += !feature.marker && segments > feature.first_segment ? 1 : 0;
  AddRegions(feature);
}

// Adds a seed for each polygon of a feature: for all of its faces, whatever else cuts it.
void GeoJsonFeatures::AddRegions(const GeoJsonLevel& feature) {
  bool has_polygons = false;
  for (size_t at = feature.first_place; at < domain_.places.size();) {
    const size_t outer = at++;
    if (domain_.places[outer].ring == GeoJsonPlace::kNone) {
      continue;
    }
    has_polygons = true;
    while (at < domain_.places.size() && domain_.places[at].ring != GeoJsonPlace::kNone &&
           domain_.places[at].ring > 0) {
      ++at;
    }
    if (!feature.region) {
      continue;
    }
    const uint64_t first = domain_.places[outer].first_point;
    const uint64_t end = at < domain_.places.size() ? domain_.places[at].first_point : domain_.point_count();
    std::vector<size_t> starts;
    for (size_t ring = outer; ring < at; ++ring) {
      starts.push_back(domain_.places[ring].first_point - first);
    }
    const auto point =
        InteriorPoint(std::span<const double>(domain_.points).subspan(2 * first, 2 * (end - first)), starts);
    if (!point) {
      ++flat_;
      continue;
    }
    const uint64_t segment = domain_.places[outer].first_segment;
    domain_.seeds.push_back(
        {.x = (*point)[0],
         .y = (*point)[1],
         .attribute = *feature.region,
         .first_segment = segment,
         .segment_count =
             (at < domain_.places.size() ? domain_.places[at].first_segment : domain_.segment_count()) - segment});
    domain_.seed_places.push_back(static_cast<uint32_t>(outer));
  }
  without_region_ += has_polygons && !feature.region ? 1 : 0;
}

void GeoJsonFeatures::NoteFeatures() const {
  const auto note = [this](uint64_t count, std::string_view one, std::string_view more) {
    if (count > 0) {
      domain_.notes.push_back(absl::StrCat(domain_.name, ": ", count, std::string(count == 1 ? one : more)));
    }
  };
  note(empty_, " geometry is null or has no positions", " geometries are null or have no positions");
  if (!options_.region_property.empty()) {
    const std::string name = Quote(options_.region_property);
    note(without_region_, absl::StrCat(" feature with polygons has no property ", name, ", and gets no region"),
         absl::StrCat(" features with polygons have no property ", name, ", and get no regions"));
    note(flat_, " polygon has no inside, and gets no region", " polygons have no inside, and get no regions");
  }
  if (!options_.marker_property.empty()) {
    const std::string name = Quote(options_.marker_property);
    note(without_marker_, absl::StrCat(" feature has no property ", name, ", and its segments the marker 0"),
         absl::StrCat(" features have no property ", name, ", and their segments the marker 0"));
  }
}

// Longitudes that go around the world are no coordinates of one plane.
void GeoJsonFeatures::NoteWidth() const {
  constexpr double kHalfTurn = 180;
  double low = INFINITY;
  double high = -INFINITY;
  for (size_t i = 0; i < domain_.points.size(); i += 2) {
    low = std::min(low, domain_.points[i]);
    high = std::max(high, domain_.points[i]);
    if (std::abs(domain_.points[i]) > 2 * kHalfTurn || std::abs(domain_.points[i + 1]) > kHalfTurn / 2) {
      return;  // these are no longitudes and latitudes
    }
  }
  if (high - low > kHalfTurn) {
    domain_.notes.push_back(absl::StrCat(domain_.name, ": longitudes span ", high - low,
                                         " degrees; they are taken as coordinates of a plane, in which both sides of "
                                         "the 180th meridian are far apart, and triangles near the poles are not what "
                                         "they are on the sphere"));
  }
}

void GeoJsonFeatures::Finish() {
  domain_.markers.resize(domain_.segment_count());
  const auto has = [this](uint8_t value) {
    return std::find(domain_.is_line.begin(), domain_.is_line.end(), value) != domain_.is_line.end();
  };
  if (!has(0) || !has(1)) {
    domain_.is_line.clear();
  }
  if (std::adjacent_find(domain_.groups.begin(), domain_.groups.end(), std::not_equal_to<>()) == domain_.groups.end()) {
    domain_.groups.clear();  // one feature, or none
  }
  domain_.segment_lines = {};  // places say where segments are
  NoteFeatures();
  NoteWidth();
}

}  // namespace wellspace::formats
