// The coordinates of a geometry of GeoJSON, or of another format with the same ones. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_GEOMETRY_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_GEOMETRY_H_

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/domain/planar_domain.h"

namespace wellspace::formats {

enum class GeometryType { kPoint, kMultiPoint, kLineString, kMultiLineString, kPolygon, kMultiPolygon };

// Collects positions from nested arrays, whose meaning the type of the geometry says, which may come after them.
//
// Thread safety: thread-compatible.
class GeoJsonGeometry {
 public:
  // An array starts on `line` of the file, or ends; a number comes. They stand in the value of "coordinates".
  //
  // Errors:     messages without a location.
  absl::Status StartArray(uint64_t line);
  absl::Status EndArray();
  absl::Status AddNumber(double number);
  // Whether an array is open.
  bool is_open() const { return depth_ > 0; }
  // "[2][0][7]": which element of the open arrays comes.
  std::string Path() const;

  // Adds the points and segments of the geometry, which is at `place`, to the domain, and forgets them. The geometry
  // `is_empty` if it has no positions.
  //
  // REQUIRES:   no array is open.
  // Errors:     INVALID_ARGUMENT with a location.
  absl::Status MoveTo(GeometryType type, const GeoJsonPlace& place, PlanarDomain& domain, bool& is_empty);

 private:
  // Positions in arrays that are nested deeper are of no type.
  static constexpr int kMaxDepth = 4;

  // An array of arrays, or an empty one.
  struct Closed {
    int depth = 0;           // 1: the outermost
    uint64_t line = 0;       // where it starts
    uint64_t positions = 0;  // how many there were at its end
  };

  // `is_flat` tells of a ring that encloses nothing, or of a line without length, which are not added.
  absl::Status AddPart(GeometryType type, std::span<const double> positions, const GeoJsonPlace& place,
                       PlanarDomain& domain, bool& is_flat) const;
  // An INVALID_ARGUMENT at a place.
  static absl::Status Error(const PlanarDomain& domain, const GeoJsonPlace& place, std::string_view message);

  int depth_ = 0;                                // of open arrays
  std::array<uint64_t, kMaxDepth + 1> index_{};  // of the element that comes, by depth
  std::array<uint64_t, kMaxDepth + 1> lines_{};  // where the open arrays start, by depth
  int numbers_ = 0;                              // in the innermost open array, 3 if there are more
  std::array<double, 2> position_{};
  int position_depth_ = 0;         // of the arrays that are positions; 0: there is none yet
  std::vector<double> positions_;  // n x 2
  std::vector<Closed> closed_;     // in the order of their ends
  uint64_t altitudes_ = 0;
};

// "Polygon" and so on.
const char* TypeName(GeometryType type);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_GEOMETRY_H_
