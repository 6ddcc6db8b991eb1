// The objects of GeoJSON, RFC 7946: which members and types they have, and where they may stand. Private to
// read_geojson.cc and its parts.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_OBJECTS_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_OBJECTS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "client/formats/domain/planar_domain.h"

namespace wellspace::formats {

// The members of an object of GeoJSON that mean something.
enum class GeoJsonMember { kType, kFeatures, kGeometry, kGeometries, kCoordinates, kProperties, kForeign };
inline constexpr std::array<const char*, 6> kGeoJsonMembers = {"type",       "features",    "geometry",
                                                               "geometries", "coordinates", "properties"};

GeoJsonMember GeoJsonMemberOf(std::string_view name);

// The types of objects: the values of GeometryType, in its order, then the others.
inline constexpr std::array<const char*, 9> kGeoJsonTypes = {
    "Point",        "MultiPoint",         "LineString", "MultiLineString",  "Polygon",
    "MultiPolygon", "GeometryCollection", "Feature",    "FeatureCollection"};
inline constexpr int kGeoJsonGeometryTypes = 6;
enum GeoJsonType { kNoType = -1, kGeometryCollection = kGeoJsonGeometryTypes, kFeature, kFeatureCollection };

// The places in a file where an object of GeoJSON may stand.
enum class GeoJsonRole { kTop, kFeature, kGeometry };

// The type of this name, if an object that stands there may have it; else kNoType, and `accepted` says which it may.
int GeoJsonTypeOf(std::string_view name, GeoJsonRole role, std::string& accepted);

// A container of GeoJSON that is open. Containers of "coordinates" and of foreign members are not among them.
struct GeoJsonLevel {
  enum Kind { kObject, kFeatures, kGeometries, kProperties } kind = kObject;
  uint64_t line = 0;   // where it starts
  uint64_t index = 0;  // of the element that comes, of an array
  // Of an object:
  GeoJsonRole role = GeoJsonRole::kTop;
  GeoJsonMember member = GeoJsonMember::kForeign;  // the last key
  int type = kNoType;
  std::array<bool, 7> has{};  // by GeoJsonMember
  // Of a feature: the meaning of its properties, and the counts of the domain before.
  std::optional<double> region = std::nullopt;
  std::optional<int32_t> marker = std::nullopt;
  uint64_t first_segment = 0;
  size_t first_place = 0;
};

// The fault in the members of an object that ends; empty if there is none.
std::string WrongMembers(const GeoJsonLevel& object);

// The place of `geometry` in its file; `levels` are those that are open around it. Members of collections of geometries
// are noted in the domain.
GeoJsonPlace GeoJsonPlaceOf(const GeoJsonLevel& geometry, std::span<const GeoJsonLevel> levels, PlanarDomain& domain);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_OBJECTS_H_
