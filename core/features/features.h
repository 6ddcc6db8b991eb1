// The features of a domain in the plane as they are given: segments, holes and regions.
#ifndef WELLSPACE_CORE_FEATURES_FEATURES_H_
#define WELLSPACE_CORE_FEATURES_FEATURES_H_

#include <cstdint>
#include <limits>
#include <span>

#include "core/features/part_names.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The rule by which faces of the planar graph of the segments are meshed.
enum class FaceRule : uint8_t {
  kBox,      // all faces in the box
  kHoles,    // all bounded faces; the box bounds nothing
  kEvenOdd,  // faces that an odd number of ring segments separates from infinity
  kUnion,    // faces that an odd number of ring segments of some group separates from infinity
};

// The treatment of segments that cross, and of vertices that are too close to a segment.
enum class CrossingRule : uint8_t {
  kRefuse,  // an error names them
  kSnap,    // a segment is led through a vertex that is too close to it, or nearer than the snap distance; crossings
            // are refused
  kSplit,   // the same, and a crossing, rounded, becomes a vertex
};

// A hole or a region: the face that a point lies in, or all faces inside of a polygon.
struct FaceSeed {
  Point<2> at{};                                              // the point; of a polygon not looked at
  bool is_hole = false;                                       // the face is not meshed
  int32_t region = 0;                                         // of the simplices in the face, unless a hole
  double max_area = std::numeric_limits<double>::infinity();  // of a simplex there; a squared length
  // The rings of a polygon: its segments from the first on. It holds the faces that an odd number of them separates
  // from infinity. 0: it is a point.
  uint32_t first_segment = 0;
  uint32_t segment_count = 0;

  bool IsPolygon() const { return segment_count > 0; }
  bool SaysTheSameAs(const FaceSeed& other) const {
    return is_hole == other.is_hole && region == other.region && max_area == other.max_area;
  }
};

// Segments and seeds beside n given points. The spans have to outlive this.
struct Features {
  std::span<const uint32_t> ends;    // m x 2, row-major: indices of points
  std::span<const int32_t> markers;  // m, or none: then all are 0
  std::span<const uint8_t>
      is_open;  // m, or none: 1 for a segment that is no part of a ring, so that kEvenOdd and kUnion ignore it
  std::span<const uint32_t> groups;  // m, or none: the group of each, any number; of kUnion. None: all are of one
  std::span<const FaceSeed> seeds;
  FaceRule faces = FaceRule::kBox;
  CrossingRule crossings = CrossingRule::kRefuse;
  double snap_distance = 0;          // of the points' unit; none where kRefuse
  const PartNames* names = nullptr;  // null: the default ones

  size_t segment_count() const { return ends.size() / 2; }
  bool IsEmpty() const { return ends.empty() && seeds.empty(); }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_FEATURES_H_
