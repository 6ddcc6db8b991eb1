// The segment that a cell meets: rule 1 of a domain begins with it (PlaneRules::AssessCell).
#ifndef WELLSPACE_CORE_REFINE_PLANE_MET_PART_H_
#define WELLSPACE_CORE_REFINE_PLANE_MET_PART_H_

#include <cstdint>
#include <span>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_place.h"

namespace wellspace::core {

// The part of a segment that a cell meets: from one distance from its end `a` to another.
struct MetPart {
  uint32_t segment = SegmentPoint::kNone;
  double from = 0;
  double to = 0;
  double distance = 0;  // from the site of the cell to the nearest point of the part

  bool IsThere() const { return segment != SegmentPoint::kNone; }
};

// Whether the `cell` of `v`, whose nodes need not be placed, may meet any of `segments` that v is not on: if not,
// NearestMet finds none.
//
// Complexity: O(segments).
bool MayMeetAny(const PlanarDomain& domain, VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments);

// The part of the nearest of `segments` that `cell`, that of `v`, meets though v is not on it; of those that are as
// near the one of the lowest number. A part that is no longer than rounding errors does not count, nor do segments that
// are `passed_over`.
//
// REQUIRES:   the nodes of the cell are placed.
// Complexity: O(nodes segments).
MetPart NearestMet(const PlanarDomain& domain, VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments,
                   std::span<const uint32_t> passed_over);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_MET_PART_H_
