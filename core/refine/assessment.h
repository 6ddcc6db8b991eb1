// What is wrong with a clipped Voronoi cell, by the radius-edge criterion.
#ifndef WELLSPACE_CORE_REFINE_ASSESSMENT_H_
#define WELLSPACE_CORE_REFINE_ASSESSMENT_H_

#include <limits>

#include "core/geometry/box.h"
#include "core/voronoi/polytope.h"

namespace wellspace::core {

// Lengths are squared; infinite where there is none.
struct Assessment {
  // The bad node with the shortest edge among those of edges no longer than the limit, and the plane of that edge's
  // bisector.
  int bad_node = -1;
  int bad_plane = -1;
  // The shortest edge beyond the limit that has a bad node.
  double next_edge_sq = 0;
  // A face of the box that the cell touches though its site does not lie on it, the nearest one; -1 for none.
  int encroached_face = -1;
  // The cell reaches the cube that it was clipped by.
  bool is_clipped = false;
  // The farthest node; infinite if a node on one of the site's own faces is too far for its shortest edge: no
  // circumcentre, so it asks for nothing now, but the site must look again once a new vertex cuts the facet there.
  double radius_sq = 0;

  bool IsGood() const { return bad_node < 0 && encroached_face < 0 && !is_clipped && next_edge_sq == kNone; }

  static constexpr double kNone = std::numeric_limits<double>::infinity();
};

// Looks for a node x whose nearest generator u has |x| > rho |u|: such an x in the interior of the box is a
// circumcentre of a simplex that breaks rho. Only edges |u|^2 <= edge_limit_sq ask for a Steiner point now.
//
// Complexity: O(nodes).
// Errors:     none.
// Source:     docs/design/core.md, the loop.
template <int D>
Assessment Assess(const Polytope<D>& cell, FaceMask site_faces, double rho, double edge_limit_sq);

extern template Assessment Assess<2>(const Polytope<2>&, FaceMask, double, double);
extern template Assessment Assess<3>(const Polytope<3>&, FaceMask, double, double);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_ASSESSMENT_H_
