// A domain in the plane as a file has it: points, segments between them, holes and regions.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_PLANAR_DOMAIN_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_PLANAR_DOMAIN_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/formats/cloud.h"

namespace wellspace::formats {

// A place in GeoJSON: a ring, a line, or positions without segments, by the indices that lead there, each from 0.
struct GeoJsonPlace {
  static constexpr uint32_t kNone = static_cast<uint32_t>(-1);

  uint64_t first_point = 0;     // that stands there
  uint64_t first_segment = 0;   // whose first end stands there
  uint64_t line = 0;            // of the file, where its first position is
  bool is_feature = false;      // whether the geometry is that of a feature
  bool has_index = true;        // whether positions have one: not that of a Point
  uint32_t feature = kNone;     // of a collection of features
  uint32_t collection = kNone;  // index in PlanarDomain::collections, for a member of a collection of geometries
  uint32_t part = kNone;        // of a geometry with parts: a polygon of several, a line of several
  uint32_t ring = kNone;        // of a polygon
};

// A planar straight-line graph, not cleaned: points may coincide, segments may cross, overlap, or have no length.
//
// Thread safety: thread-compatible.
struct PlanarDomain {
  // The faces that count: the whole box; all bounded faces without a hole; those that an odd number of rings surround;
  // those that an odd number of rings of some group surround.
  enum class FaceRule { kBox, kHoles, kEvenOdd, kUnion };

  // A seed of faces: a point for the one that it is in, or a polygon for all inside of it.
  struct Seed {
    double x = 0;
    double y = 0;
    bool is_hole = false;
    double attribute = 0;
    double max_area = 0;  // of a triangle; 0: no bound
    // The rings of a polygon, of which (x, y) is a point inside: so many segments from the first on. 0: it is a point.
    uint64_t first_segment = 0;
    uint64_t segment_count = 0;

    bool operator==(const Seed&) const = default;
  };

  std::string name;                    // of the file, as messages say it
  std::vector<double> points;          // point_count() x 2, row-major
  std::vector<int32_t> point_markers;  // of each point, or empty if the file has none
  std::vector<uint32_t> segments;      // segment_count() x 2, indices of points
  std::vector<int32_t> markers;        // of each segment; 0 where the file has none
  // Of each segment 1 if it belongs to a line beside polygons, which does not turn inside to outside under kEvenOdd and
  // kUnion; or empty if there are no such lines.
  std::vector<uint8_t> is_line;
  // Of each segment its group, of GeoJSON the first segment of its feature; or empty if all are of one.
  std::vector<uint32_t> groups;
  std::vector<Seed> seeds;  // holes first, then regions; of GeoJSON polygons
  // Of GeoJSON whose properties are names: these, by the numbers that stand for them, from 1 on.
  std::map<int32_t, std::string> marker_names;
  std::map<int32_t, std::string> region_names;
  FaceRule faces = FaceRule::kBox;  // the rule of the format: of .poly HOLES, of polygons UNION, of lines alone BOX

  // Counts of parts that were changed, or are not used.
  uint64_t repeated_points = 0;  // dropped: equal to the one before in a ring or a line
  uint64_t unclosed_rings = 0;   // closed, though their first point is not repeated as the last
  uint64_t altitudes = 0;        // positions of GeoJSON with more than two numbers
  uint64_t flat_rings = 0;  // of GeoJSON, left out: they enclose nothing, or are of a polygon whose outer ring is so
  uint64_t flat_lines = 0;  // of GeoJSON, left out: of fewer than two different positions
  std::string first_flat;   // where the first of both is
  uint64_t rounded_numbers = 0;  // coordinates of GeoJSON that are whole numbers above 2^53, and no doubles
  std::string first_rounded;     // the first of them, and where it is
  // Notes for the user on how the file was read, a sentence each.
  std::vector<std::string> notes;

  // The places of things in the file; see PointOrigin. In GeoJSON `lines` of points are positions in their ring.
  std::string points_name;  // of the file that has the points, if it is another one
  LineIndex point_lines;
  LineIndex segment_lines;
  LineIndex seed_lines;
  std::vector<GeoJsonPlace> places;      // of GeoJSON, ascending by first_point
  std::vector<std::string> collections;  // "geometries[1]." for the second member of a collection, and so on
  std::vector<uint32_t> seed_places;     // of GeoJSON: the ring around each seed, an index in `places`

  uint64_t point_count() const { return points.size() / 2; }
  uint64_t segment_count() const { return segments.size() / 2; }

  // Where a point, a segment or a seed was read: "lake.poly:17", "lake.node:3", or in GeoJSON, counted from 0,
  // "land.geojson:1: features[4].geometry.coordinates[2][0][7]", which jq understands after a dot. A segment of GeoJSON
  // is where its first end is, and its line that where the ring begins.
  // REQUIRES: the index is below the number of points, segments or seeds.
  std::string PointOrigin(uint64_t point) const;
  std::string SegmentOrigin(uint64_t segment) const;
  std::string SeedOrigin(uint64_t seed) const;
};

// "features[4].geometry.coordinates[2][0]": the path to a place.
std::string PathOf(const GeoJsonPlace& place, const std::vector<std::string>& collections);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_PLANAR_DOMAIN_H_
