#include "core/refine/assessment.h"

#include <algorithm>
#include <cmath>

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

// The squared length of the shortest edge that a bisector of the cell stands for.
template <int D>
double ShortestEdgeSq(const Polytope<D>& cell) {
  double shortest = Assessment::kNone;
  for (const CellNode<D>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = cell.plane(index);
      if (plane.kind == PlaneKind::kBisector) {
        shortest = std::min(shortest, 2 * plane.offset);
      }
    }
  }
  return shortest;
}

}  // namespace

template <int D>
Assessment Assess(const Polytope<D>& cell, FaceMask site_faces, const Demands<D>& demands, double edge_limit_sq) {
  Assessment result;
  double bad_radius_sq = 0;
  double nearest_face = Assessment::kNone;
  const double rho_sq = demands.rho * demands.rho;
  const bool has_sizes = !demands.sizes.IsUnbounded();
  const double cell_edge_sq = demands.criterion == Criterion::kWellSpaced ? ShortestEdgeSq(cell) : Assessment::kNone;
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
    if (on_face) {
      continue;
    }
    double bound_sq = rho_sq * std::min(edge_sq, cell_edge_sq);
    bool is_too_large = false;
    if (node.radius_sq <= bound_sq) {
      bound_sq = Assessment::kNone;
    }
    if (on_own_face) {
      result.own_face_edge_sq = std::min(result.own_face_edge_sq, bound_sq / rho_sq);
      continue;
    }
    if (has_sizes) {
      Point<D> x = cell.site();
      for (int k = 0; k < D; ++k) {
        x[k] += node.x[k];
      }
      const double size_sq = demands.sizes.AtSq(x);
      if (node.radius_sq > size_sq && size_sq < bound_sq) {
        bound_sq = size_sq;
        is_too_large = true;
      }
    }
    if (bound_sq == Assessment::kNone) {
      continue;
    }
    if (bound_sq > rho_sq * edge_limit_sq) {
      result.next_edge_sq = std::min(result.next_edge_sq, bound_sq / rho_sq);
    } else if (bound_sq < result.bound_sq || (bound_sq == result.bound_sq && node.radius_sq > bad_radius_sq)) {
      result.bound_sq = bound_sq;
      result.bad_node = static_cast<int>(i);
      result.bad_plane = edge_plane;
      result.is_too_large = is_too_large;
      bad_radius_sq = node.radius_sq;
    }
  }
  return result;
}

#define WELLSPACE_INSTANTIATE(D) template Assessment Assess<D>(const Polytope<D>&, FaceMask, const Demands<D>&, double);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
