// Rules by which a step follows from a cell: its fault, the place of a new vertex, and the notices to its neighbours.
// CellSteps asks in each step of a vertex in the box; PlaneRules takes clip and candidates from here.
#ifndef WELLSPACE_CORE_REFINE_STEP_RULES_H_
#define WELLSPACE_CORE_REFINE_STEP_RULES_H_

#include <cmath>
#include <optional>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/box.h"
#include "core/refine/assessment.h"
#include "core/refine/criteria.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/steiner_point.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// For the criteria of one run. Their results depend on the cell and on the places of vertices alone.
//
// Thread safety: thread-compatible; const functions may run at once, and beside QueryStructure::AddUncommitted.
template <int D>
class StepRules {
 public:
  // Computes the cell of a vertex, clipped by a box; null if that cannot be done.
  using CellOf = absl::FunctionRef<const Polytope<D>*(VertexId, const Box<D>&)>;

  // No vertex is to be added nearer than `min_edge` to another.
  //
  // REQUIRES:   `structure` outlives this.
  StepRules(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria, double min_edge);

  const MeshCriteria<D>& criteria() const { return criteria_; }
  FaceMask FacesOf(VertexId v) const { return structure_.faces(v); }

  // A cell is clipped at this many times the longest edge of its bucket.
  double clip_factor() const { return clip_factor_; }

  // Half the side of the cube that clips the cells of a bucket which ends at edge_limit_sq.
  double ClipRadius(double edge_limit_sq) const { return clip_factor_ * std::sqrt(edge_limit_sq); }

  Box<D> ClipAround(VertexId v, double edge_limit_sq) const {
    return CubeAround<D>(structure_.point(v), ClipRadius(edge_limit_sq));
  }

  // The fault of a cell, whose nodes are placed unless it is plainly good.
  //
  // Complexity: O(nodes).
  // Source:     [HT08] Figure 4, lines 8 and 11.
  Assessment AssessCell(Polytope<D>& cell, FaceMask site_faces, double edge_limit_sq) const;

  // The insertion that `cell`, that of `v`, asks for by edges up to a bucket's limit, by its assessment; none if there
  // is none. Calls cell_of at most once.
  //
  // Complexity: O(nodes), and the cell.
  // Source:     [HT08] Figure 4, line 11; docs/design/refine.md.
  std::optional<InsertionRequest<D>> NextRequest(VertexId v, const Polytope<D>& cell, const Assessment& found,
                                                 double edge_limit_sq, CellOf cell_of) const;

  // The point for the bad node of `cell`, that of `v`, before anything takes its place; and, in that cell for sure, the
  // one that an off-centre is. `is_at_boundary`: the node is the circumcentre of a simplex with a corner there.
  //
  // Complexity: as NextRequest.
  SteinerPoint<D> CandidateFor(VertexId v, const Polytope<D>& cell, const Assessment& found, bool is_at_boundary,
                               double edge_limit_sq, CellOf cell_of) const;
  SteinerPoint<D> OffCenterFor(const Polytope<D>& cell, const Assessment& found, bool is_at_boundary) const;

  // Whether a vertex at `point` is far enough from all others; if not, the run ends with an error.
  bool IsLongEnough(const SteinerPoint<D>& point) const { return point.empty_radius_sq >= min_edge_ * min_edge_; }

  // Appends the neighbours that PendingVertices::Notify may have to schedule.
  //
  // Complexity: O(nodes); O(1) for an inner cell by the radius-edge criterion, which has none.
  void AppendNotices(const Polytope<D>& cell, FaceMask site_faces, const Assessment& found,
                     std::vector<NeighborNotice>& notices) const;

  // Appends the nodes of the cell of `v` on faces of v that are too far for the edge that is to be remembered, if one
  // is, or for a longer one.
  //
  // Complexity: O(nodes).
  void AppendNodesToWatch(VertexId v, const Polytope<D>& cell, const Assessment& found,
                          std::vector<WatchedNode<D>>& watched) const;

 private:
  double DistanceSqFor(const Assessment& found, bool is_at_boundary) const;
  bool IsAtBoundary(VertexId v, const Polytope<D>& cell, int node) const;

  const QueryStructure<D>& structure_;
  const MeshCriteria<D> criteria_;
  const double min_edge_;
  const double off_center_factor_;
  const double boundary_factor_;  // in the place of that at the boundary, for radius-edge
  const double plain_ratio_;      // cells that keep it need nothing; 0: that does not tell
  const double clip_factor_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_STEP_RULES_H_
