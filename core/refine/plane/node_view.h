// The surroundings of a node of a cell in the plane. PlaneRules looks at each node of a cell so: which triangle stands
// behind it, in which direction that lies, and by which name the node is known.
#ifndef WELLSPACE_CORE_REFINE_PLANE_NODE_VIEW_H_
#define WELLSPACE_CORE_REFINE_PLANE_NODE_VIEW_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"
#include "core/refine/assessment.h"

namespace wellspace::core {

// A node by the vertices that it is equidistant from beside the site, the lesser number first; kNoVertex where it lies
// on the clip.
using NodeName = std::pair<VertexId, VertexId>;

// The generators of a node: the vertices whose bisectors meet there. Valid as long as the cell is not cut.
struct NodeView {
  NodeView(const Polytope<2>& cell, const CellNode<2>& node) : toward(node.x) {
    Point<2> sum = {};
    for (const uint16_t index : node.planes) {
      const Plane<2>& plane = cell.plane(index);
      if (plane.kind != PlaneKind::kBisector) {
        continue;
      }
      generators[bisectors++] = &plane;
      sum = {sum[0] + plane.normal[0] / plane.length, sum[1] + plane.normal[1] / plane.length};
      if (2 * plane.offset < edge_sq || (2 * plane.offset == edge_sq && plane.vertex < cell.plane(nearest).vertex)) {
        edge_sq = 2 * plane.offset;
        nearest = index;
      }
    }
    if (IsTriangle()) {
      toward = sum;
    }
  }

  // Whether it is the circumcentre of a triangle, and not on the clip.
  bool IsTriangle() const { return bisectors == 2; }

  // REQUIRES:   IsTriangle().
  double AreaOfTriangle() const { return 0.5 * std::abs(Cross(generators[0]->normal, generators[1]->normal)); }

  NodeName Name() const {
    const VertexId first = bisectors > 0 ? generators[0]->vertex : kNoVertex;
    const VertexId second = bisectors > 1 ? generators[1]->vertex : kNoVertex;
    return std::minmax(first, second);
  }

  std::array<const Plane<2>*, 2> generators = {};  // the first `bisectors` of them
  size_t bisectors = 0;
  double edge_sq = Assessment::kNone;  // squared distance to the nearest generator
  int nearest = -1;                    // plane of the nearest generator; -1 if there is none
  Point<2> toward;                     // from the site into the triangle, or to the node if there is none
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_NODE_VIEW_H_
