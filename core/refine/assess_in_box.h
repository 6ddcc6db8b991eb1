// The faults of a cell in the box, whatever bounds its nodes have: Assess runs it for a cloud, SpaceRules for a
// domain in space, whose solids have bounds of their own.
#ifndef WELLSPACE_CORE_REFINE_ASSESS_IN_BOX_H_
#define WELLSPACE_CORE_REFINE_ASSESS_IN_BOX_H_

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/cell/polytope.h"
#include "core/refine/assess_nodes.h"
#include "core/refine/assessment.h"
#include "core/refine/criteria.h"

namespace wellspace::core {

// Whether a node is on bisectors alone and near enough for their edges, and for edges up to `most_sq`: so are most
// nodes. Without a branch, which could not be predicted.
template <int D>
bool IsPlainlyGood(const Polytope<D>& cell, const CellNode<D>& node, double rho_sq, double most_sq) {
  bool is_on_wall = false;
  for (const uint16_t index : node.planes) {
    const Plane<D>& plane = cell.plane(index);
    is_on_wall |= plane.kind != PlaneKind::kBisector;
    most_sq = std::min(most_sq, 2 * plane.offset);
  }
  return !is_on_wall & (node.radius_sq <= rho_sq * most_sq);
}

// The facts about a node that its planes tell.
struct NodePlanes {
  double edge_sq = Assessment::kNone;  // the shortest of its edges
  int edge_plane = -1;                 // its bisector
  VertexId generator = kNoVertex;      // and its other end
  bool on_face = false;                // of the box that the site is not on
  bool on_own_face = false;            // that it is on
};

// Notes in `result` whether the cell is clipped there, and a face that it touches there if that is nearer than
// `nearest_face`.
template <int D>
NodePlanes LookAtPlanes(const Polytope<D>& cell, const CellNode<D>& node, FaceMask site_faces, double& nearest_face,
                        Assessment& result) {
  NodePlanes found;
  for (const uint16_t index : node.planes) {
    const Plane<D>& plane = cell.plane(index);
    if (plane.kind == PlaneKind::kBisector) {
      if (2 * plane.offset < found.edge_sq || (2 * plane.offset == found.edge_sq && plane.vertex < found.generator)) {
        found.generator = plane.vertex;
        found.edge_sq = 2 * plane.offset;
        found.edge_plane = index;
      }
    } else if (plane.kind == PlaneKind::kClip) {
      result.is_clipped = true;
    } else if (((site_faces >> plane.face) & 1) != 0) {
      found.on_own_face = true;
    } else {
      found.on_face = true;
      const double distance = std::abs(plane.offset);
      if (distance < nearest_face || (distance == nearest_face && plane.face < result.encroached_face)) {
        nearest_face = distance;
        result.encroached_face = plane.face;
      }
    }
  }
  return found;
}

// Decides between bad nodes with one bound by their places, whatever their numbers: the farther comes first.
template <int D>
struct NodeRank {
  const CellNode<D>* node = nullptr;
  VertexId generator = kNoVertex;  // the nearest

  bool operator<(const NodeRank& other) const {
    return std::tie(node->radius_sq, node->x, other.generator) <
           std::tie(other.node->radius_sq, other.node->x, generator);
  }
};

// Assesses the nodes of a cell, and which faces of the box it touches. `bounds` has three functions of a node:
// RhoSq(node), the square of its rho; HasSizes(node), whether sizes count there; and SizeSq(node, x, most), of a node
// at x, the lesser of its largest squared distance and `most`. No edge counts as longer than
// the root of `cell_edge_sq`; edges are bounds by `rho_sq`.
//
// Complexity: O(nodes).
template <int D, typename Bounds>
void AssessInBox(const Polytope<D>& cell, FaceMask site_faces, double rho_sq, double cell_edge_sq, double edge_limit_sq,
                 Bounds& bounds, Assessment& result) {
  double nearest_face = Assessment::kNone;
  const auto look = [&](const CellNode<D>& node) -> NodeVerdict<NodeRank<D>> {
    result.radius_sq = std::max(result.radius_sq, node.radius_sq);
    const bool has_sizes = bounds.HasSizes(node);
    const double own_rho_sq = bounds.RhoSq(node);
    if (!has_sizes && IsPlainlyGood(cell, node, own_rho_sq, cell_edge_sq)) {
      return {};
    }
    const auto [edge_sq, edge_plane, generator, on_face, on_own_face] =
        LookAtPlanes(cell, node, site_faces, nearest_face, result);
    if (on_face) {
      return {};
    }
    double bound_sq = own_rho_sq * std::min(edge_sq, cell_edge_sq);
    bool is_too_large = false;
    if (node.radius_sq <= bound_sq) {
      bound_sq = Assessment::kNone;
    }
    if (has_sizes && !on_own_face) {
      Point<D> x = cell.site();
      for (int k = 0; k < D; ++k) {
        x[k] += node.x[k];
      }
      const double size_sq = bounds.SizeSq(node, x, std::min(node.radius_sq, bound_sq));
      if (node.radius_sq > size_sq && size_sq < bound_sq) {
        bound_sq = size_sq;
        is_too_large = true;
      }
    }
    return {bound_sq, is_too_large, on_own_face, edge_plane, {&node, generator}};
  };
  AssessNodes(cell, rho_sq, edge_limit_sq, look, result);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_ASSESS_IN_BOX_H_
