// The nodes of a cell from 4-D on once it has been cut: their places, by their planes, and the queries of them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/base/dimensions.h"
#include "core/cell/cell_parts.h"
#include "core/cell/meeting_point.h"
#include "core/cell/polytope.h"

namespace wellspace::core {

template <int D>
void Polytope<D>::Place() {
  PlaceWanted([](size_t) { return true; });
}

template <int D>
bool Polytope<D>::PlaceUnlessKeeps(double ratio) {
  if (KeepsRatio(ratio)) {
    return true;
  }
  PlaceWanted([this, ratio](size_t node) { return !SurelyKeeps(node, ratio); });
  return false;
}

// Fills nodes_, and places those that is_wanted(node) holds of.
template <int D>
template <typename IsWanted>
void Polytope<D>::PlaceWanted(IsWanted is_wanted) {
  if (is_placed_) {
    return;
  }
  is_placed_ = true;
  nodes_.resize(columns_.count());
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const NodeTopology& topology = topologies_[i];
    if (!topology.is_placed) {
      if (is_wanted(i)) {
        PlaceNode(i);
      } else {
        is_placed_ = false;
      }
    }
    CellNode<D>& node = nodes_[i];
    node.x = columns_.x(i);
    node.slack = columns_.slack(i);
    node.radius_sq = NormSq<D>(node.x);
    node.reach = std::sqrt(node.radius_sq) + node.slack;
    node.planes = topology.planes;
    for (int k = 0; k < D; ++k) {
      node.neighbours[k] = static_cast<Index>(NodeOf(opposite_[EndAt(i, k)]));
    }
  }
  SetReach(columns_.FindLargest());
}

// Places a node by its planes, in their order.
template <int D>
void Polytope<D>::PlaceNode(size_t node) {
  NodeTopology& topology = topologies_[node];
  topology.is_placed = true;
  const std::array<uint16_t, D> planes = topology.planes;
  std::array<End, D> ends;
  std::copy_n(&opposite_[EndAt(node, 0)], D, ends.begin());
  const std::array<uint32_t, D> ranks = RanksOf<D>(planes_, planes);
  for (int k = 0; k < D; ++k) {
    topology.planes[ranks[k]] = planes[k];
    Join(EndAt(node, ranks[k]), ends[k]);
  }
  Point<D> x;
  const double slack = PlaceByPlanes<D>(site_, planes_, topology.planes, x);
  columns_.Set(node, x, slack);
}

template <int D>
bool Polytope<D>::KeepsRatio(double ratio) const {
  for (size_t i = 0; i < columns_.count(); ++i) {
    if (!SurelyKeeps(i, ratio)) {
      return false;
    }
  }
  return true;
}

// KeepsRatio, of one node.
template <int D>
WELLSPACE_INLINE bool Polytope<D>::SurelyKeeps(size_t node, double ratio) const {
  // No branch, since it could not be predicted.
  double nearest = std::numeric_limits<double>::infinity();
  bool is_on_wall = false;
  for (const uint16_t index : topologies_[node].planes) {
    const Plane<D>& plane = planes_[index];
    is_on_wall |= plane.kind != PlaneKind::kBisector;
    nearest = std::min(nearest, plane.length);
  }
  const double reach = std::sqrt(NormSq<D>(columns_.x(node))) + columns_.slack(node);
  return !is_on_wall & (reach <= ratio * (1 - 4 * kPlacedError) * nearest);
}

template <int D>
void Polytope<D>::FindStar(Star<D>& out) const {
  out.resize(columns_.count());
  size_t count = 0;
  for (size_t i = 0; i < columns_.count(); ++i) {
    // No branch, since it could not be predicted where there are walls.
    std::array<VertexId, D>& simplex = out[count];
    uint32_t is_simplex = 1;
    for (int k = 0; k < D; ++k) {
      const Plane<D>& plane = planes_[topologies_[i].planes[k]];
      simplex[k] = plane.vertex;
      is_simplex &= plane.kind == PlaneKind::kBisector ? 1 : 0;
    }
    count += is_simplex;
  }
  out.resize(count);
}

#define WELLSPACE_INSTANTIATE(D)                       \
  template void Polytope<D>::Place();                  \
  template bool Polytope<D>::PlaceUnlessKeeps(double); \
  template bool Polytope<D>::KeepsRatio(double) const; \
  template void Polytope<D>::FindStar(Star<D>&) const;
WELLSPACE_FOR_EACH_DIMENSION_ABOVE_3(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
