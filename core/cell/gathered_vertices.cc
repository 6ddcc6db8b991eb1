#include "core/cell/gathered_vertices.h"

#include <bit>

#include "core/cell/float_vertices.h"

namespace wellspace::core {
namespace {

// Fewer cells take as long one by one as it takes to gather.
constexpr size_t kFewestSites = 8;
// Vertices in two leaves side by side, along each axis, so that they are worked on together.
constexpr size_t kMostInTwo = 128;
// In mean distances between vertices that are neighbours. Vertices within this distance of the sites are gathered,
// which matter to nearly all cells.
constexpr double kWithin = 2.8;
// Vertices within this distance of a site, which cut most, are looked at before all others.
constexpr double kNear = 2.1;

}  // namespace

// Takes as many sites, from the first on, as lie in a box no longer than a leaf, or two; `spacing` is the mean
// distance of vertices in their leaves.
template <int D>
typename GatheredVertices<D>::SitesTogether GatheredVertices<D>::TakeSites(const LeafTree<D>& tree,
                                                                           std::span<const Point<D>> points,
                                                                           std::span<const VertexId> sites) {
  const auto point = [&](VertexId v) -> const Point<D>& { return points[Index(v)]; };
  const NodeId first = tree.leaf_of(sites[0]);
  const size_t in_two = size_t{tree.VerticesIn(first)->count} << D;
  const double longest = tree.SideOf(first) * (in_two <= kMostInTwo ? 2 : 1);
  SitesTogether taken{.box = {point(sites[0]), point(sites[0])}};
  NodeId leaf = kNoNode;
  double volume = 0;  // of the leaves that they are in
  double vertices = 0;
  for (; taken.count < sites.size(); ++taken.count) {
    const VertexId v = sites[taken.count];
    Box<D> with = taken.box;
    with.Include({point(v), point(v)});
    if (with.LongestSide() > longest) {
      break;
    }
    taken.box = with;
    if (tree.leaf_of(v) != leaf) {
      leaf = tree.leaf_of(v);
      volume += std::pow(tree.SideOf(leaf), D);
      vertices += tree.VerticesIn(leaf)->count;
    }
  }
  taken.spacing = std::pow(volume / vertices, 1.0 / D);
  return taken;
}

template <int D>
size_t GatheredVertices<D>::Gather(const LeafTree<D>& tree, std::span<const Point<D>> points,
                                   std::span<const VertexId> sites, std::span<uint32_t> seen, uint32_t mark) {
  Clear();
  const SitesTogether taken = TakeSites(tree, points, sites);
  if (taken.count < kFewestSites) {
    return taken.count;
  }
  Begin(taken.box, taken.spacing);
  const auto meet = [&](NodeId met) {
    const bool is_new = seen[Index(met)] != mark;
    seen[Index(met)] = mark;
    if (is_new && DistanceSq<D>(tree.BoxOf(met), sites_) <= within_ * within_ * (1 + 0x1p-40)) {
      leaves_.push_back(met);
    }
  };
  // From leaf to leaf across faces: leaves_ is the queue of a breadth-first search.
  meet(tree.leaf_of(sites[0]));
  for (size_t i = 0; i < leaves_.size(); ++i) {
    const auto* inside = tree.VerticesIn(leaves_[i]);
    if (inside != nullptr && !Add({inside->positions, inside->count}, inside->ids)) {
      Clear();
      return taken.count;
    }
    tree.ForEachFaceNeighbour(leaves_[i], meet);
  }
  for (auto& column : columns_) {
    std::fill_n(&column[count_], kFloatLanes, std::numeric_limits<float>::quiet_NaN());
  }
  is_whole_ = true;
  return taken.count;
}

template <int D>
void GatheredVertices<D>::Begin(const Box<D>& sites, double spacing) {
  sites_ = sites;
  within_ = kWithin * spacing;
  near_sq_ = kNear * spacing * kNear * spacing;
  for (int axis = 0; axis < D; ++axis) {
    center_[axis] = 0.5 * (sites.low[axis] + sites.high[axis]);
  }
  scale_ = std::exp2(-std::ilogb(sites.LongestSide() + within_));
  positions_.resize(kMost + kFloatLanes);
  names_.resize(kMost + kFloatLanes);
  for (auto& column : columns_) {
    column.resize(kMost + kFloatLanes);
  }
}

// Adds those of the vertices of a leaf that are to be gathered; false where there are too many.
template <int D>
bool GatheredVertices<D>::Add(std::span<const Point<D>> positions, const VertexId* names) {
  for (size_t i = 0; i < positions.size(); ++i) {
    const Point<D>& p = positions[i];
    // No branch, since it could not be predicted.
    positions_[count_] = p;
    names_[count_] = names[i];
    for (int axis = 0; axis < D; ++axis) {
      columns_[axis][count_] = InColumn(p, axis);
    }
    count_ += Holds(p) ? 1 : 0;
    if (count_ > kMost) {
      return false;
    }
  }
  return true;
}

template <int D>
template <VectorUnit kUnit>
WELLSPACE_INLINE double GatheredVertices<D>::NearestSqWith(VertexId v, const Point<D>& site) const {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  alignas(sizeof(Floats)) float distances_sq[kMost + kFloatLanes];
  Floats least = Splat(kInfinity);
  ForEachDistanceSq<D>(
      *this, site, [&](size_t i, const Floats& distance_sq) __attribute__((always_inline)) {
        *reinterpret_cast<Floats*>(distances_sq + i) = distance_sq;
        const FloatMask counts = IsLess<kUnit>(Floats{}, distance_sq);  // but for v, and vertices too near to tell
        least = Min<kUnit>(least, Choose<kUnit>(counts, distance_sq, Splat(kInfinity)));
      });
  const double nearest = std::sqrt(double{-Largest<kUnit>(-least)}) + 2 * kColumnError;
  const Floats most_sq = Splat(static_cast<float>(nearest * nearest));
  double nearest_sq = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < count_; i += kFloatLanes) {
    uint32_t near = Bits<kUnit>(IsAtMost<kUnit>(*reinterpret_cast<const Floats*>(distances_sq + i), most_sq));
    for (; near != 0; near &= near - 1) {
      const size_t j = i + static_cast<size_t>(std::countr_zero(near));
      if (names_[j] != v) {
        nearest_sq = std::min(nearest_sq, DistanceSq<D>(positions_[j], site));
      }
    }
  }
  return nearest_sq;
}

template <int D>
WELLSPACE_AVX2 double GatheredVertices<D>::NearestSqAvx2(VertexId v, const Point<D>& site) const {
  return NearestSqWith<VectorUnit::kAvx2>(v, site);
}

template <int D>
double GatheredVertices<D>::NearestSq(VertexId v, const Point<D>& site, VectorUnit unit) const {
  return unit == VectorUnit::kAvx2 ? NearestSqAvx2(v, site) : NearestSqWith<VectorUnit::kBaseline>(v, site);
}

template class GatheredVertices<2>;
template class GatheredVertices<3>;

}  // namespace wellspace::core
