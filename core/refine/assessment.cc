#include "core/refine/assessment.h"

#include <algorithm>

#include "core/base/dimensions.h"
#include "core/refine/assess_in_box.h"

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

// The bounds of all nodes in the box.
template <int D>
struct BoxBounds {
  double rho_sq = 0;
  bool has_sizes = false;
  const SizeField<D>& sizes;
  SizeHint hint{};

  double RhoSq(const CellNode<D>& /*node*/) const { return rho_sq; }
  bool HasSizes(const CellNode<D>& /*node*/) const { return has_sizes; }
  double SizeSq(const CellNode<D>& /*node*/, const Point<D>& x, double most) { return sizes.AtSq(x, most, &hint); }
};

}  // namespace

template <int D>
Assessment Assess(const Polytope<D>& cell, FaceMask site_faces, const MeshCriteria<D>& criteria, double edge_limit_sq) {
  Assessment result;
  const double rho_sq = criteria.rho * criteria.rho;
  const double cell_edge_sq = criteria.criterion == Criterion::kWellSpaced ? ShortestEdgeSq(cell) : Assessment::kNone;
  BoxBounds<D> bounds{rho_sq, !criteria.sizes.IsUnbounded(), criteria.sizes};
  AssessInBox<D>(cell, site_faces, rho_sq, cell_edge_sq, edge_limit_sq, bounds, result);
  return result;
}

#define WELLSPACE_INSTANTIATE(D) \
  template Assessment Assess<D>(const Polytope<D>&, FaceMask, const MeshCriteria<D>&, double);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
