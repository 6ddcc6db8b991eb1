// The place of a vertex in a domain of the plane: a point of a segment, or inside a face. PlanarDomain keeps places of
// vertices, requests carry them, and points that are added get them (PointPlacer).
#ifndef WELLSPACE_CORE_REFINE_PLANE_PLANE_PLACE_H_
#define WELLSPACE_CORE_REFINE_PLANE_PLANE_PLACE_H_

#include <cstdint>
#include <limits>

#include "core/refine/insertion.h"

namespace wellspace::core {

// A point of a segment, strictly between its ends, as the distance from one of them.
struct SegmentPoint {
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  uint32_t segment = kNone;
  bool is_from_b = false;
  double distance = 0;  // from that end: a number that the point has, however it is rounded

  bool IsOnSegment() const { return segment != kNone; }
};

// The data that the distance of a place on a segment depends on, beside the vertices near to it. RoundPlace notes it,
// and AreSplitsInOrder asks of a recorded request whether it still is so.
enum class SplitOrder : uint8_t {
  kAny,            // nothing
  kFirst,          // no vertex has been inserted on the segment
  kAfterExpected,  // none had when it was asked for, but one that was expected has
};

// Where a new vertex is: on a segment, or else inside a face.
struct PlanePlace {
  SegmentPoint on;
  uint32_t face = 0;
  SplitOrder order = SplitOrder::kAny;

  bool IsOnFeature() const { return on.IsOnSegment(); }
};

using PlaneRequest = InsertionRequest<2, PlanePlace>;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_PLANE_PLACE_H_
