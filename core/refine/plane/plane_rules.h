// The rules of refinement in a domain of the plane: the faults of a cell, the segment to be split, and where
// a new vertex goes. PlaneSteps asks them in each step of a vertex, for the loop and for the threads that speculate.
#ifndef WELLSPACE_CORE_REFINE_PLANE_PLANE_RULES_H_
#define WELLSPACE_CORE_REFINE_PLANE_PLANE_RULES_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/refine/insertion.h"
#include "core/refine/plane/expected_vertices.h"
#include "core/refine/plane/met_part.h"
#include "core/refine/plane/node_view.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_place.h"
#include "core/refine/plane/visible_domain.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The faults of a cell in a domain. The loop and the records see the base alone; the part is for the request.
struct PlaneAssessment : Assessment {
  MetPart met;  // there if is_segment_encroached
};

// The requests that a cell has made in vain: no place for a vertex was far enough from others. It asks no more for it.
struct PassedOver {
  std::vector<NodeName> nodes;
  std::vector<uint32_t> segments;  // that it meets
};

// A cell asks for one insertion at a time. The first of these that applies decides:
//   1. It meets a segment that its site is not on: the nearest one is split (NearestMet, SplitPlace); or passed over,
//      where no double separates the new vertex from one that is there.
//   2. A node breaks a bound, of rho, of a size or of an area: a point in its sector (CandidateIn), or, if that is too
//      near to a segment or beyond one, its foot there (YieldPlace, RoundPlace). Where the foot would come too near at
//      a small angle, the node is refused.
//   3. Nothing: the vertex is done, or looked at later.
// Refused nodes, and those passed over, are left out when the cell is looked at again.
// These nodes do not count: one in a face that is not meshed; one between whose generators an own segment lies
// (IsCrossed), which is only remembered; by rho, one whose triangle is across (IsAcross); one that was refused.
//
// For the criteria of one run. Their results depend on the cell, on the places of vertices and on the
// domain alone: not on the leaves of the tree, which are split while others speculate.
//
// Thread safety: thread-compatible; const functions may run at once, and, with expected vertices, beside
// QueryStructure::AddUncommitted and PlanarDomain::AddVertex.
class PlaneRules {
 public:
  // The vertices are those of the structure, uncommitted ones, too; or those that are committed, and the `expected`.
  //
  // REQUIRES:   all references outlive this.
  PlaneRules(const QueryStructure<2>& structure, const PlanarDomain& domain, const StepRules<2>& rules,
             const ExpectedVertices* expected = nullptr)
      : visible_(structure, domain, expected),
        rules_(rules),
        plain_ratio_(rules.criteria().sizes.IsUnbounded() && !domain.HasAreaBounds() ? rules.criteria().rho : 0) {}

  const StepRules<2>& step_rules() const { return rules_; }

  // How far `v` is from the nearest segment that it is not on, squared, if that is less than `limit_sq`; else that. By
  // it a vertex comes into its first bucket.
  //
  // Complexity: that of a query.
  double NearestFeatureSq(VertexId v, double limit_sq, Workspace<2>& workspace) const;

  // The faults of the cell of `v`, whose nodes are placed unless it is plainly good; `segments` has all that meet
  // it. The part of a cell beyond the segments of v, on sides that are not meshed, does not count. Nodes and segments
  // in `passed_over` ask for nothing.
  //
  // Complexity: O(nodes segments).
  PlaneAssessment AssessCell(VertexId v, Polytope<2>& cell, std::span<const uint32_t> segments, double edge_limit_sq,
                             const PassedOver& passed_over) const;

  // The insertion that `cell`, that of `v`, asks for by its assessment; or the node or segment that is to be passed
  // over, after which the cell has to be assessed again; none of these if nothing is asked for. `segments` as in
  // AssessCell; cell_of computes cells in `workspace`.
  //
  // Complexity: O(nodes), a few queries, and the cell of cell_of.
  struct Answer {
    std::optional<PlaneRequest> request;
    std::optional<NodeName> refused_node;
    std::optional<uint32_t> passed_segment;
  };
  Answer NextRequest(VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments,
                     const PlaneAssessment& found, double edge_limit_sq, StepRules<2>::CellOf cell_of,
                     Workspace<2>& workspace) const;

 private:
  // The squared distance from the site that a node must not exceed.
  struct Bound {
    double sq = 0;
    bool is_size = false;  // a size or an area, not rho
  };

  const QueryStructure<2>& structure() const { return visible_.structure(); }
  const PlanarDomain& domain() const { return visible_.domain(); }

  // The nodes that count, and their bounds.
  bool IsAcross(VertexId v, VertexId u, const Point<2>& toward) const;
  bool IsAcrossFrom(uint32_t segment, bool is_b, VertexId v, VertexId u, const Point<2>& toward) const;
  bool IsCrossed(VertexId v, const NodeView& node) const;
  Bound BoundOf(const Polytope<2>& cell, const CellNode<2>& node, const NodeView& view, uint32_t face) const;

  // The insertion for a node that counts.
  bool IsAtSegment(VertexId v, const NodeView& node) const;
  SteinerPoint<2> CandidateIn(size_t sector, VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments,
                              const Assessment& found, bool is_at_segment, double edge_limit_sq,
                              StepRules<2>::CellOf cell_of, Workspace<2>& workspace) const;
  SteinerPoint<2> OffCenterIn(const Polytope<2>& cell, std::span<const uint32_t> segments, const Assessment& found,
                              bool is_at_segment, Workspace<2>& workspace) const;
  void AddSegmentsNear(const SteinerPoint<2>& point, std::span<const uint32_t> segments, Workspace<2>& workspace) const;
  // Whether the way from `v` to `p` begins in a sector.
  bool LeadsInto(VertexId v, size_t sector, const Point<2>& p) const {
    return domain().SectorToward(v, Difference<2>(p, structure().point(v))) == sector;
  }
  SegmentPoint YieldPlace(const SteinerPoint<2>& candidate, VertexId v, bool is_in_sector,
                          std::span<const uint32_t> segments, double& distance_sq) const;

  // A vertex on a segment, by rule 1 or in the place of a point.
  PlaneRequest RequestAt(VertexId v, const PlanePlace& place, double edge_limit_sq, Workspace<2>& workspace) const;

  const VisibleDomain visible_;
  const StepRules<2>& rules_;
  const double plain_ratio_;  // rho, where nothing else is asked of triangles; else 0
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_PLANE_RULES_H_
