#include "core/refine/assessment.h"

#include <algorithm>
#include <cmath>

namespace wellspace::core {

template <int D>
Assessment Assess(const Polytope<D>& cell, FaceMask site_faces, double rho, double edge_limit_sq) {
  Assessment result;
  result.next_edge_sq = Assessment::kNone;
  double bad_edge_sq = Assessment::kNone;
  double nearest_face = Assessment::kNone;
  const double rho_sq = rho * rho;
  for (size_t i = 0; i < cell.nodes().size(); ++i) {
    const CellNode<D>& node = cell.nodes()[i];
    double edge_sq = Assessment::kNone;
    int edge_plane = -1;
    bool on_face = false;
    bool on_own_face = false;
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = cell.plane(index);
      if (plane.kind == PlaneKind::kBisector) {
        if (2 * plane.offset < edge_sq) {
          edge_sq = 2 * plane.offset;
          edge_plane = index;
        }
      } else if (plane.kind == PlaneKind::kClip) {
        result.is_clipped = true;
      } else if (((site_faces >> plane.face) & 1) != 0) {
        on_own_face = true;
      } else {
        on_face = true;
        if (std::abs(plane.offset) < nearest_face) {
          nearest_face = std::abs(plane.offset);
          result.encroached_face = plane.face;
        }
      }
    }
    result.radius_sq = std::max(result.radius_sq, node.radius_sq);
    if (node.radius_sq <= rho_sq * edge_sq || on_face) {
      continue;
    }
    if (on_own_face) {
      result.radius_sq = Assessment::kNone;
    } else if (edge_sq > edge_limit_sq) {
      result.next_edge_sq = std::min(result.next_edge_sq, edge_sq);
    } else if (edge_sq < bad_edge_sq ||
               (edge_sq == bad_edge_sq && node.radius_sq > cell.nodes()[result.bad_node].radius_sq)) {
      bad_edge_sq = edge_sq;
      result.bad_node = static_cast<int>(i);
      result.bad_plane = edge_plane;
    }
  }
  return result;
}

template Assessment Assess<2>(const Polytope<2>&, FaceMask, double, double);
template Assessment Assess<3>(const Polytope<3>&, FaceMask, double, double);

}  // namespace wellspace::core
