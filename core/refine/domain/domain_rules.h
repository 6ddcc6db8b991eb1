// How a step follows from a cell in a domain of the plane: which segment is to be split, and where a new vertex goes.
#ifndef WELLSPACE_CORE_REFINE_DOMAIN_DOMAIN_RULES_H_
#define WELLSPACE_CORE_REFINE_DOMAIN_DOMAIN_RULES_H_

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/refine/domain/expected_vertices.h"
#include "core/refine/domain/planar_domain.h"
#include "core/refine/insertion.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The part of a segment that a cell meets: from one distance from its end `a` to another.
struct MetPart {
  uint32_t segment = SegmentPoint::kNone;
  double from = 0;
  double to = 0;
  double distance = 0;  // from the site of the cell to the nearest point of the part

  bool IsThere() const { return segment != SegmentPoint::kNone; }
};

// A node by the vertices that it is equidistant from beside the site.
using NodeName = std::pair<VertexId, VertexId>;

// A cell asks for one insertion at a time. The first of these that applies decides:
//   1. It meets a segment that its site is not on: the nearest one is split (SplitPlace), at the foot of the site or,
//      at a small angle, at the site's own distance from the common end.
//   2. A node breaks a bound: a point in its sector (CandidateIn), or, if that is too near to a segment or beyond one,
//      its foot there (YieldPlace). Where the foot would come too near at a small angle, the node is refused.
//   3. Nothing: the vertex is done, or looked at later.
// A node in a face that is not meshed, one whose triangle is across, and one between whose generators an own segment
// lies, do not count.
//
// For the criteria of one run. What the functions return depends on the cell, on the places of vertices and on the
// domain alone.
//
// Thread safety: thread-compatible; const functions may run at once, and, with expected vertices, beside
// QueryStructure::AddUncommitted and PlanarDomain::AddVertex.
class DomainRules {
 public:
  // The vertices are those of the structure, uncommitted ones, too; or those that are committed, and the `expected`.
  //
  // REQUIRES:   all references outlive this.
  DomainRules(const QueryStructure<2>& structure, const PlanarDomain& domain, const StepRules<2>& rules,
              const ExpectedVertices* expected = nullptr)
      : structure_(structure), domain_(domain), rules_(rules), expected_(expected) {}

  // What is wrong with the cell of `v`, whose nodes are placed; `segments` has all that meet it. `met` is the nearest
  // of them that v is not on. What a cell is beyond the segments of v, on sides that are not meshed, does not count.
  // Nodes in `refused` ask for nothing.
  //
  // Complexity: O(nodes segments).
  Assessment AssessCell(VertexId v, Polytope<2>& cell, std::span<const uint32_t> segments, double edge_limit_sq,
                        std::span<const NodeName> refused, MetPart& met) const;

  // The insertion that `cell`, that of `v`, asks for by what was found. `refused` is the node that asks for nothing
  // more, if one is; none of both if nothing is asked for.
  struct Answer {
    std::optional<InsertionRequest<2>> request;
    std::optional<NodeName> refused;
  };
  Answer NextRequest(VertexId v, const Polytope<2>& cell, const Assessment& found, const MetPart& met,
                     double edge_limit_sq, StepRules<2>::CellOf cell_of, Workspace<2>& workspace) const;

  // Whether on the segments of recorded `requests`, those of one vertex, vertices have been inserted as it was assumed.
  //
  // Complexity: O(requests^2).
  bool AreInOrder(std::span<const InsertionRequest<2>> requests) const;

  // How far `v` is from the nearest segment that it is not on, squared, if that is less than `limit_sq`; else that.
  double NearestSegmentSq(VertexId v, double limit_sq, Workspace<2>& workspace) const;

 private:
  struct NodeView;
  struct Bound {
    double sq = 0;
    bool is_size = false;  // a size or an area, not rho
  };

  // 1. Segments that the cell meets.
  MetPart MeetSegment(const Polytope<2>& cell, uint32_t segment) const;
  MetPart NearestMet(VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments) const;
  PlaceInDomain SplitPlace(VertexId v, const MetPart& met) const;
  PlaceInDomain RoundPlace(SegmentPoint on, double room) const;
  InsertionRequest<2> RequestAt(VertexId v, const PlaceInDomain& place, double edge_limit_sq,
                                Workspace<2>& workspace) const;

  // 2. Nodes: which of them count, by which bound, and what takes their place.
  bool IsAcross(VertexId v, VertexId u, const Point<2>& toward) const;
  bool IsCrossed(VertexId v, const NodeView& node) const;
  bool IsAtSegment(VertexId v, const NodeView& node) const;
  Bound BoundOf(const Polytope<2>& cell, const CellNode<2>& node, const NodeView& view, uint32_t face) const;
  // Whether the way from `v` to `p` begins in a sector.
  bool LeadsInto(VertexId v, size_t sector, const Point<2>& p) const {
    return domain_.SectorToward(v, Difference<2>(p, structure_.point(v))) == sector;
  }
  SteinerPoint<2> CandidateIn(size_t sector, VertexId v, const Polytope<2>& cell, const Assessment& found,
                              bool is_at_segment, double edge_limit_sq, StepRules<2>::CellOf cell_of,
                              Workspace<2>& workspace) const;
  SegmentPoint YieldPlace(const SteinerPoint<2>& candidate, VertexId v, bool is_in_sector,
                          std::span<const uint32_t> segments, double& distance_sq) const;

  // Of vertices that may be expected; else as the structure and the domain have it.
  bool IsExpected(VertexId u) const { return expected_ != nullptr && expected_->Has(u); }
  const Point<2>& PointOf(VertexId u) const { return IsExpected(u) ? expected_->point(u) : structure_.point(u); }
  bool IsFree(VertexId u) const { return IsExpected(u) ? !expected_->PlaceOf(u).IsOnSegment() : domain_.IsFree(u); }
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

  const QueryStructure<2>& structure_;
  const PlanarDomain& domain_;
  const StepRules<2>& rules_;
  const ExpectedVertices* const expected_;  // null: none
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_DOMAIN_DOMAIN_RULES_H_
