// The faults of a clipped Voronoi cell, as the nodes tell. StepRules::AssessCell asks for it in every step of a
// vertex; its future is PendingVertices' and StepRules::NextRequest's to say.
#ifndef WELLSPACE_CORE_REFINE_ASSESSMENT_H_
#define WELLSPACE_CORE_REFINE_ASSESSMENT_H_

#include <limits>

#include "core/cell/polytope.h"
#include "core/geometry/box.h"
#include "core/refine/criteria.h"

namespace wellspace::core {

// Made by Assess for a cell in the box, and by PlaneRules::AssessCell for one in a domain of the plane, where segments
// take the place of the faces of the box. Lengths are squared; infinite where there is none.
struct Assessment {
  // The node to be repaired first: of the nodes whose bound is of the shortest edge the farthest, the plane of the
  // bisector with its nearest generator (-1 if it is on none), and the distance from the site that it must not exceed.
  int bad_node = -1;
  int bad_plane = -1;
  double bound_sq = kNone;
  // The shortest edge beyond the limit that has a bad node.
  double next_edge_sq = kNone;
  // The farthest node; 0 where is_plain, since it is not looked for.
  double radius_sq = 0;
  // The shortest edge with a node that is too far for it and belongs to the boundary where the site is: it lies on one
  // of the site's own faces of the box or, in a domain, one of the site's own segments lies between its generators. It
  // is no circumcentre, so it asks for nothing now; but the site must look again, with that edge, once a new vertex
  // cuts it off.
  double own_boundary_edge_sq = kNone;
  // A face of the box that the cell touches though its site does not lie on it, the nearest one; -1 for none, and in a
  // domain.
  int encroached_face = -1;
  bool is_segment_encroached = false;  // in a domain: the cell meets a segment that its site does not lie on
  bool is_too_large = false;           // the bound is one of the sizes, not of rho
  bool is_clipped = false;             // the cell reaches the cube that it was clipped by
  // Found good by Polytope::PlaceUnlessKeeps alone: the cell touches no face, and its nodes may not be placed.
  bool is_plain = false;

  bool IsGood() const {
    return bad_node < 0 && encroached_face < 0 && !is_segment_encroached && !is_clipped && next_edge_sq == kNone;
  }

  static constexpr double kNone = std::numeric_limits<double>::infinity();
};

// Looks for nodes x of the cell that are too far from its site: |x| > rho |u|, u the nearest generator of x
// (radius-edge) or of the whole cell (well-spaced), or |x| > h(x). In the interior of the box such an x is the
// circumcentre of a simplex that has to go. The edge of a bound b is b / rho, for one of the sizes too; only nodes of
// edges |u|^2 <= edge_limit_sq ask for a Steiner point now.
//
// Complexity: O(nodes).
// Errors:     none.
// Source:     docs/design/refine.md, the loop.
template <int D>
Assessment Assess(const Polytope<D>& cell, FaceMask site_faces, const MeshCriteria<D>& criteria, double edge_limit_sq);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_ASSESSMENT_H_
