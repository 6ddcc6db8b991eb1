// Vertices of a domain in the plane that are not inserted yet, but that recorded steps are to insert. Rounds::Record
// makes one of its batch; the rules see it by a VisibleDomain.
#ifndef WELLSPACE_CORE_REFINE_PLANE_EXPECTED_VERTICES_H_
#define WELLSPACE_CORE_REFINE_PLANE_EXPECTED_VERTICES_H_

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/point.h"
#include "core/refine/insertion.h"
#include "core/refine/plane/plane_place.h"
#include "core/voronoi/extra_vertices.h"

namespace wellspace::core {

// The vertices that a batch expects to be inserted, by provisional numbers: neither the structure nor the domain knows
// of it.
//
// Thread safety: thread-compatible.
class ExpectedVertices {
 public:
  // REQUIRES:   `positions` and `requests` are of the same vertices, one after the other, and outlive this.
  ExpectedVertices(const ExtraVertices<2>& positions, const std::vector<PlaneRequest>& requests)
      : positions_(positions), requests_(requests) {}

  // Whether the number of `v` is provisional.
  bool Has(VertexId v) const { return v >= positions_.first(); }

  // REQUIRES:   Has(v).
  const Point<2>& point(VertexId v) const { return RequestOf(v).point.position; }
  const SegmentPoint& PlaceOf(VertexId v) const { return RequestOf(v).place.on; }

  // Whether one of them is on `segment`.
  //
  // Complexity: O(vertices).
  bool AreOn(uint32_t segment) const {
    return std::any_of(requests_.begin(), requests_.end(),
                       [&](const PlaneRequest& request) { return request.place.on.segment == segment; });
  }

  // The squared distance from `p` to the nearest of them, if it is less than `limit_sq`; else that.
  double NearestSq(const Point<2>& p, double limit_sq) const {
    positions_.ForEachRunNear(p, limit_sq, [&](std::span<const Point<2>> run, VertexId /*first*/) {
      for (const Point<2>& q : run) {
        limit_sq = std::min(limit_sq, DistanceSq<2>(q, p));
      }
    });
    return limit_sq;
  }

 private:
  const PlaneRequest& RequestOf(VertexId v) const { return requests_[Index(v) - Index(positions_.first())]; }

  const ExtraVertices<2>& positions_;
  const std::vector<PlaneRequest>& requests_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_EXPECTED_VERTICES_H_
