// Where a vertex is in a domain of the plane.
#ifndef WELLSPACE_CORE_REFINE_DOMAIN_SEGMENT_POINT_H_
#define WELLSPACE_CORE_REFINE_DOMAIN_SEGMENT_POINT_H_

#include <cstdint>
#include <limits>

namespace wellspace::core {

// A point of a segment, strictly between its ends, as the distance from one of them.
struct SegmentPoint {
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  uint32_t segment = kNone;
  bool is_from_b = false;
  double distance = 0;  // from that end: a number that the point has, however it is rounded

  bool IsOnSegment() const { return segment != kNone; }
};

// Where a new vertex is: on a segment, or else inside a face.
struct PlaceInDomain {
  SegmentPoint on;
  uint32_t face = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_DOMAIN_SEGMENT_POINT_H_
