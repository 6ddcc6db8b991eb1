// Where a new vertex goes: circumcentre or off-centre, and its place on the boundary of the box.
#ifndef WELLSPACE_CORE_REFINE_STEINER_POINT_H_
#define WELLSPACE_CORE_REFINE_STEINER_POINT_H_

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/voronoi/polytope.h"

namespace wellspace::core {

template <int D>
struct SteinerPoint {
  Point<D> position;
  double empty_radius_sq = 0;  // no vertex is nearer than this to it
};

// How far from the site, relative to rho times the edge, an off-centre lies at most: a hair below Üngör's distance in
// 2-D, where the new triangle just keeps rho; 1.1 in 3-D. Measured, see docs/design/core.md.
template <int D>
double OffCenterFactor(double rho);

// A point of the cell for its bad node `node`, whose shortest edge is that of plane `plane`: the node itself, or the
// point of the segment from it towards the edge's midpoint at distance factor * rho * |edge| from the site, as far as
// the segment is in the cell.
//
// Guarantees: (1) in the closed cell up to rounding, so that its distance to the site is that to its nearest vertex;
//             (2) not nearer to the site than min(node, rho * |edge|).
// Complexity: O(planes).
// Errors:     none.
// Source:     [Ung04].
template <int D>
SteinerPoint<D> OffCenter(const Polytope<D>& cell, int node, int plane, double rho, double factor);

// A point of the cell's facet on face `face` of the box: the mean of its nodes.
//
// Complexity: O(nodes).
// Errors:     none.
// Source:     docs/design/core.md, the loop.
template <int D>
SteinerPoint<D> EncroachmentPoint(const Polytope<D>& cell, int face);

// Projects a point on each face, the nearest first, that it is too near to: nearer than its empty radius over sqrt 2.
// As nothing lies beyond the face the projection keeps an empty ball, whose radius is updated.
//
// Guarantees: (1) the result is in the box, and has the coordinate of each of its faces exactly.
// Complexity: O(D^2).
// Errors:     none.
// Source:     docs/design/core.md, the loop.
template <int D>
SteinerPoint<D> SnapToBoundary(const Box<D>& box, SteinerPoint<D> point);

extern template double OffCenterFactor<2>(double);
extern template double OffCenterFactor<3>(double);
extern template SteinerPoint<2> OffCenter<2>(const Polytope<2>&, int, int, double, double);
extern template SteinerPoint<3> OffCenter<3>(const Polytope<3>&, int, int, double, double);
extern template SteinerPoint<2> EncroachmentPoint<2>(const Polytope<2>&, int);
extern template SteinerPoint<3> EncroachmentPoint<3>(const Polytope<3>&, int);
extern template SteinerPoint<2> SnapToBoundary<2>(const Box<2>&, SteinerPoint<2>);
extern template SteinerPoint<3> SnapToBoundary<3>(const Box<3>&, SteinerPoint<3>);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_STEINER_POINT_H_
