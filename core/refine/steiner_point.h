// Steiner points: circumcentre, off-centre or farther in a petal, and their places on the boundary of the box.
#ifndef WELLSPACE_CORE_REFINE_STEINER_POINT_H_
#define WELLSPACE_CORE_REFINE_STEINER_POINT_H_

#include "core/cell/polytope.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

template <int D>
struct SteinerPoint {
  Point<D> position;
  double empty_radius_sq = 0;  // no vertex is nearer than this to it
};

// How far from the site, relative to rho times the edge, an off-centre lies at most: a hair below Üngör's distance in
// 2-D, where the new triangle just keeps rho; 1.1 in higher dimensions. Nearer in 2-D, farther in 3-D, if the simplex
// that is to go has a corner on the boundary of the box. Measured, see docs/design/refine.md.
template <int D>
double OffCenterFactor(double rho, bool is_at_boundary);

// The same relative to the largest circumradius that the sizes allow.
inline constexpr double kSizeFactor = 1.5;

// A point of the cell for its bad node `node`, which lies on the bisector `plane`, or on none (-1): the node itself if
// its squared distance from the site is at most distance_sq; else the point at that distance on the segment from it
// towards the midpoint of the edge, as far as the segment is in the cell. Where the bisector is too far for that, or
// there is none, on the segment towards the site.
//
// Guarantees: (1) in the closed cell up to rounding, so that its distance to the site is that to its nearest vertex;
//             (2) not nearer to the site than min(node, sqrt(distance_sq)).
// Complexity: O(planes).
// Errors:     none.
// Source:     [Ung04].
template <int D>
SteinerPoint<D> OffCenter(const Polytope<D>& cell, int node, int plane, double distance_sq);

// In the plane, of an edge v u: the disc through both ends and the point that lies sqrt(top_sq) from both, on the side
// of a node of their bisector. Points of its circle there see the edge at the angle at which that one does, points
// within at a larger one.
struct Petal {
  Point<2> centre;  // relative to the site v
  double radius = 0;
};
Petal PetalOf(const Polytope<2>& cell, int node, int plane, double top_sq);

// In the plane, a point of the cell for its bad node `node`, on the bisector `plane` of the site v and u, where
// OffCenter would take the node itself: from the node on along the boundary of the cell, away from u, in the petal of v
// u, and while that leads away from v. The farthest from v, and so from all vertices, that conforms to sizes as the
// node does. The way leads away from v if the triangle whose circumcentre the node is has an obtuse angle at u.
//
// REQUIRES:   the node at more than rho |u| from the site, and at most sqrt(top_sq).
// Guarantees: (1) on the boundary of the cell up to rounding, so that its distance to the site is that to its nearest
//             vertex; (2) not nearer to the site than the node; (3) a point p with (rho - 1) (|up| - |vp|) <= |vp| -
//             rho |u|, or the node.
// Complexity: O(nodes).
// Errors:     none.
// Source:     H. Erten, A. Üngör, Quality triangulations with locally optimal Steiner points, 2009; (3):
//             docs/design/guarantees.md.
SteinerPoint<2> PetalPoint(const Polytope<2>& cell, int node, int plane, double top_sq, double rho);

// A point of the cell's facet on face `face` of the box: the mean of its nodes that also lie on those of `site_faces`,
// the faces that the site lies on, that meet `face`. There are such nodes: an empty ball about a point of the cell
// stays empty when it is projected on one of them. So a vertex of a face never makes another face's vertices denser
// than those of the edge between the two.
//
// Complexity: O(nodes).
// Errors:     none.
// Source:     docs/design/refine.md.
template <int D>
SteinerPoint<D> EncroachmentPoint(const Polytope<D>& cell, FaceMask site_faces, int face);

// Projects a point on each face, the nearest first, that it is too near to: nearer than its empty radius over sqrt 2.
// As nothing lies beyond the face the projection keeps an empty ball, whose radius is updated.
//
// Guarantees: (1) the result is in the box, and has the coordinate of each of its faces exactly.
// Complexity: O(D^2).
// Errors:     none.
// Source:     docs/design/refine.md, the faces of the box.
template <int D>
SteinerPoint<D> SnapToBoundary(const Box<D>& box, SteinerPoint<D> point);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_STEINER_POINT_H_
