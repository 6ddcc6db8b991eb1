#include "client/formats/domain/geojson_objects.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

// The member that a type of object has to have.
GeoJsonMember ContentOf(int type) {
  switch (type) {
    case kFeatureCollection:
      return GeoJsonMember::kFeatures;
    case kFeature:
      return GeoJsonMember::kGeometry;
    case kGeometryCollection:
      return GeoJsonMember::kGeometries;
    default:
      return GeoJsonMember::kCoordinates;
  }
}

}  // namespace

GeoJsonMember GeoJsonMemberOf(std::string_view name) {
  return static_cast<GeoJsonMember>(std::find(kGeoJsonMembers.begin(), kGeoJsonMembers.end(), name) -
                                    kGeoJsonMembers.begin());
}

int GeoJsonTypeOf(std::string_view name, GeoJsonRole role, std::string& accepted) {
  const auto at = std::find(kGeoJsonTypes.begin(), kGeoJsonTypes.end(), name);
  size_t first = 0;
  size_t last = kGeoJsonTypes.size();
  if (role == GeoJsonRole::kFeature) {
    first = kFeature;
    last = kFeature + 1;
  } else if (role == GeoJsonRole::kGeometry) {
    last = kFeature;
  }
  if (at >= kGeoJsonTypes.begin() + first && at < kGeoJsonTypes.begin() + last) {
    return static_cast<int>(at - kGeoJsonTypes.begin());
  }
  accepted.clear();
  for (size_t i = first; i < last; ++i) {
    absl::StrAppend(&accepted, i == first ? "" : i + 1 == last ? " or " : ", ", kGeoJsonTypes[i]);
  }
  return kNoType;
}

std::string WrongMembers(const GeoJsonLevel& object) {
  if (object.type == kNoType) {
    return "expected an object of GeoJSON, with a \"type\", got one without";
  }
  const GeoJsonMember wanted = ContentOf(object.type);
  for (const GeoJsonMember member :
       {GeoJsonMember::kFeatures, GeoJsonMember::kGeometry, GeoJsonMember::kGeometries, GeoJsonMember::kCoordinates}) {
    if (object.has[static_cast<size_t>(member)] != (member == wanted)) {
      return absl::StrCat("expected ", member == wanted ? "" : "no ", "\"",
                          kGeoJsonMembers[static_cast<size_t>(member)], "\" in a ", kGeoJsonTypes[object.type],
                          member == wanted ? ", got none" : "");
    }
  }
  return {};
}

GeoJsonPlace GeoJsonPlaceOf(const GeoJsonLevel& geometry, std::span<const GeoJsonLevel> levels, PlanarDomain& domain) {
  GeoJsonPlace place = {.line = geometry.line};
  std::string chain;
  for (const GeoJsonLevel& level : levels) {
    if (level.kind == GeoJsonLevel::kFeatures) {
      place.feature = static_cast<uint32_t>(level.index);
    } else if (level.kind == GeoJsonLevel::kGeometries) {
      absl::StrAppend(&chain, "geometries[", level.index, "].");
    } else if (level.kind == GeoJsonLevel::kObject && level.member == GeoJsonMember::kGeometry) {
      place.is_feature = true;
    }
  }
  if (!chain.empty()) {
    place.collection = static_cast<uint32_t>(domain.collections.size());
    domain.collections.push_back(std::move(chain));
  }
  return place;
}

}  // namespace wellspace::formats
