// The place of a new vertex on a segment: at the distance that another segment has it, at a round one, or in the middle
// third. PlaneRules asks for it for requests, and for the records of them.
#ifndef WELLSPACE_CORE_REFINE_PLANE_SPLIT_PLACE_H_
#define WELLSPACE_CORE_REFINE_PLANE_SPLIT_PLACE_H_

#include <span>

#include "core/base/ids.h"
#include "core/refine/insertion.h"
#include "core/refine/plane/met_part.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_place.h"
#include "core/refine/plane/visible_domain.h"

namespace wellspace::core {

// Distances from a common end that differ by less than this, relatively, are equal: lengths of segments that are given
// are rounded.
inline constexpr double kSameDistance = 1e-9;

// Where a vertex is to split `met`, which the cell of `v` meets. In this order:
//   1. v is on a segment that makes an angle below 90 degrees with `met`: at the distance of v from the
//      common end, so that no new distance comes into being, and small angles end.
//   2. Else at the foot of v, as far as that is in the part, by RoundPlace.
//
// Source:     docs/design/features.md, where a segment is split.
PlanePlace SplitPlace(const VisibleDomain& visible, VertexId v, const MetPart& met);

// The place of a vertex that comes to `on` for another reason than an equal distance, with nothing within `room` of it.
// The first on a segment with small angles at both ends is kept in the middle third; at an end with a small angle the
// distance becomes a round one, so that equal reasons find equal distances.
PlanePlace RoundPlace(const VisibleDomain& visible, SegmentPoint on, double room);

// Whether on the segments of recorded `requests`, those of one vertex, vertices have been inserted as it was assumed.
//
// Complexity: O(requests^2).
bool AreSplitsInOrder(const PlanarDomain& domain, std::span<const PlaneRequest> requests);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_SPLIT_PLACE_H_
