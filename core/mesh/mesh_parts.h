// Parts of a mesh in the numbers of its owner: cells that are shown.
#ifndef WELLSPACE_CORE_MESH_MESH_PARTS_H_
#define WELLSPACE_CORE_MESH_MESH_PARTS_H_

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/cell/polytope.h"
#include "core/input/frame.h"
#include "core/mesh/mesh.h"

namespace wellspace::core {

// The cell of vertex `vertex`, clipped at `clip_radius`, both as the computation has them; index_of(VertexId) are the
// numbers of the mesh's owner.
//
// Complexity: O(nodes), and a sort of the neighbours.
// Errors:     none.
template <int D, typename IndexOf>
Cell DescribeCell(uint32_t vertex, double clip_radius, const Polytope<D>& polytope, const Frame<D>& frame,
                  IndexOf index_of) {
  Cell cell;
  cell.vertex = vertex;
  cell.clip_radius = clip_radius / frame.scale;
  std::vector<Point<D>> nodes;
  nodes.reserve(polytope.nodes().size());
  for (const CellNode<D>& node : polytope.nodes()) {
    Point<D> x = polytope.site();
    for (int k = 0; k < D; ++k) {
      x[k] += node.x[k];
    }
    nodes.push_back(frame.Unscaled(x));
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = polytope.plane(index);
      cell.is_clipped = cell.is_clipped || plane.kind == PlaneKind::kClip;
      if (plane.kind == PlaneKind::kBisector) {
        cell.neighbours.push_back(index_of(plane.vertex));
      }
    }
  }
  if constexpr (D == 2) {
    std::rotate(nodes.begin(), std::min_element(nodes.begin(), nodes.end()), nodes.end());
  } else {
    std::sort(nodes.begin(), nodes.end());
  }
  cell.nodes.reserve(D * nodes.size());
  for (const Point<D>& x : nodes) {
    cell.nodes.insert(cell.nodes.end(), x.begin(), x.end());
  }
  std::sort(cell.neighbours.begin(), cell.neighbours.end());
  cell.neighbours.erase(std::unique(cell.neighbours.begin(), cell.neighbours.end()), cell.neighbours.end());
  return cell;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_MESH_PARTS_H_
