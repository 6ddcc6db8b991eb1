// Where a vertex is in a domain of the plane: a point of a segment, or inside a face. Places are what PlanarDomain
// keeps of vertices, what requests carry (InsertionRequest), and what points that are added get (PointPlacer).
#ifndef WELLSPACE_CORE_REFINE_PLACE_IN_DOMAIN_H_
#define WELLSPACE_CORE_REFINE_PLACE_IN_DOMAIN_H_

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

// What the distance of a place on a segment depends on, beside the vertices near to it. RoundPlace notes it, and
// AreSplitsInOrder asks of a recorded request whether it still is so.
enum class SplitOrder : uint8_t {
  kAny,            // nothing
  kFirst,          // no vertex has been inserted on the segment
  kAfterExpected,  // none had when it was asked for, but one that was expected has
};

// Where a new vertex is: on a segment, or else inside a face.
struct PlaceInDomain {
  SegmentPoint on;
  uint32_t face = 0;
  SplitOrder order = SplitOrder::kAny;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLACE_IN_DOMAIN_H_
