// A domain as a step sees it: vertices of the structure and of the domain, and those that a batch expects. By it the
// rules are the same for the thread that inserts and for those that speculate.
#ifndef WELLSPACE_CORE_REFINE_PLANE_VISIBLE_DOMAIN_H_
#define WELLSPACE_CORE_REFINE_PLANE_VISIBLE_DOMAIN_H_

#include <cstdint>
#include <span>

#include "core/base/ids.h"
#include "core/features/planar_faces.h"
#include "core/geometry/point.h"
#include "core/refine/plane/expected_vertices.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_place.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Without expected vertices it shows all vertices that have been added, uncommitted ones, too; with them, those that
// are committed, and the expected ones, by provisional numbers. The functions are those of PlanarDomain.
//
// Thread safety: thread-compatible; with expected vertices the functions may run beside
// QueryStructure::AddUncommitted and PlanarDomain::AddVertex.
class VisibleDomain {
 public:
  // REQUIRES:   all that is given outlives this; `expected` may be null.
  VisibleDomain(const QueryStructure<2>& structure, const PlanarDomain& domain, const ExpectedVertices* expected)
      : structure_(structure), domain_(domain), expected_(expected) {}

  // Never expected are segments, faces, and vertices that cells are looked at of.
  const QueryStructure<2>& structure() const { return structure_; }
  const PlanarDomain& domain() const { return domain_; }

  const Point<2>& point(VertexId u) const { return IsExpected(u) ? expected_->point(u) : structure_.point(u); }
  bool IsInFace(VertexId u) const { return IsExpected(u) ? !expected_->PlaceOf(u).IsOnSegment() : domain_.IsInFace(u); }
  bool IsOn(VertexId u, uint32_t segment) const {
    return IsExpected(u) ? expected_->PlaceOf(u).segment == segment : domain_.IsOn(u, segment);
  }
  std::span<const HalfEdge> WaysFrom(VertexId u) const {
    return IsExpected(u) ? domain_.WaysFrom(expected_->PlaceOf(u)) : domain_.WaysFrom(u);
  }
  double DistanceFromEnd(VertexId u, uint32_t segment, bool is_b) const {
    return IsExpected(u) ? domain_.DistanceFromEnd(expected_->PlaceOf(u), is_b)
                         : domain_.DistanceFromEnd(u, segment, is_b);
  }

  // The squared distance from `p`, which is near to vertex `near`, to the nearest vertex.
  //
  // Complexity: that of a query.
  double NearestSq(const Point<2>& p, VertexId near, Workspace<2>& workspace) const {
    const double committed_sq = structure_.NearestTo(p, near, workspace).distance_sq;
    return expected_ != nullptr ? expected_->NearestSq(p, committed_sq)
                                : structure_.NearestUncommittedSq(p, committed_sq);
  }

  // Whether a vertex that is inserted on `segment` is the first there.
  SplitOrder OrderOfSplit(uint32_t segment) const {
    if (domain_.SplitsOf(segment) > 0) {
      return SplitOrder::kAny;
    }
    return expected_ != nullptr && expected_->AreOn(segment) ? SplitOrder::kAfterExpected : SplitOrder::kFirst;
  }

 private:
  bool IsExpected(VertexId u) const { return expected_ != nullptr && expected_->Has(u); }

  const QueryStructure<2>& structure_;
  const PlanarDomain& domain_;
  const ExpectedVertices* const expected_;  // null: none
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_VISIBLE_DOMAIN_H_
