#include "core/simplex/facet_walk.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace wellspace::core {
namespace {

// Vertices near a site are gathered up to so many times the radius that the last star, or the last search in this one, has needed.
constexpr double kMargin = 1.05;
// But at first not farther than so many times the longest edge of a facet: most balls reach less far.
constexpr double kEdges = 2.5;
// A vertex so little above a facet, by the length of the vector to it, is no first choice.
constexpr double kLeastHeight = 0x1p-40;

// corners[kOutward[i]]: the facet opposite to corner i, its positive side away from i, for a positive simplex.
template <int D>
constexpr std::array<std::array<int, D>, D + 1> OutwardFacets() {
  if constexpr (D == 2) {
    return {{{2, 1}, {0, 2}, {1, 0}}};
  } else {
    return {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  }
}

}  // namespace

template <int D>
typename FacetWalk<D>::Key FacetWalk<D>::KeyOf(const std::array<uint32_t, D - 1>& others, bool is_flipped) {
  if constexpr (D == 2) {
    return Key{others[0]} << 1 | static_cast<Key>(is_flipped);
  } else {
    return Key{others[0]} << 32 | others[1];
  }
}

template <int D>
typename FacetWalk<D>::Key FacetWalk<D>::Opposite(Key key) {
  return D == 2 ? key ^ 1 : key << 32 | key >> 32;
}

template <int D>
std::array<uint32_t, D - 1> FacetWalk<D>::OthersOf(Key key) {
  if constexpr (D == 2) {
    return {static_cast<uint32_t>(key >> 1)};
  } else {
    return {static_cast<uint32_t>(key >> 32), static_cast<uint32_t>(key)};
  }
}

template <int D>
void FacetWalk<D>::AppendStars(const QueryStructure<D>& structure, std::span<const NodeId> leaves,
                               std::span<const uint32_t> output_index, const RunContext& context, SimplexList<D>& out) {
  Begin(structure, leaves, output_index);
  // A cell begins the walk, which comes to all stars that hang together. Those that are left when it ends, as the leaves may not, begin again.
  uint32_t first = 0;
  for (size_t at_first = 0; at_first < leaves.size(); ++at_first) {
    const uint32_t count = structure.tree().BucketOf(leaves[at_first])->count;
    for (uint32_t i = 0; i < count; ++i) {
      if (has_simplices_[first + i] == 0) {
        AddCellOf(first + i, out);
        if (!CloseFacets(leaves, context, out)) {
          return;
        }
      }
    }
    first += LeafColumns<D>::PlacesOf(count);
    counters_.queries += count;
  }
}

// Walks until no facet is open; false when cancelled.
template <int D>
bool FacetWalk<D>::CloseFacets(std::span<const NodeId> leaves, const RunContext& context, SimplexList<D>& out) {
  while (open_count_ > 0) {
    uint32_t first = 0;
    for (const NodeId leaf : leaves) {
      const uint32_t end = first + LeafColumns<D>::PlacesOf(structure_->tree().BucketOf(leaf)->count);
      bool is_home = false;
      // A star may open facets at vertices before it.
      for (uint32_t place = first; place < end;) {
        if (first_at_[place] == kNone) {
          ++place;
          continue;
        }
        if (!is_home) {
          if (context.IsCancelled()) {
            return false;
          }
          columns_.SurroundLeaf(leaf);
          is_home = true;
        }
        CloseFacetsAt(place, out);
        place = first;
      }
      first = end;
    }
  }
  return true;
}

template <int D>
void FacetWalk<D>::Begin(const QueryStructure<D>& structure, std::span<const NodeId> leaves,
                         std::span<const uint32_t> output_index) {
  structure_ = &structure;
  output_index_ = output_index;
  columns_.Reset(structure);
  for (const NodeId leaf : leaves) {
    columns_.AddLeaf(leaf);
  }
  own_count_ = columns_.place_count();
  first_at_.assign(own_count_, kNone);
  has_simplices_.assign(own_count_, 0);
  open_.clear();
  unused_ = kNone;
  open_count_ = 0;
}

template <int D>
void FacetWalk<D>::CloseFacetsAt(uint32_t place, SimplexList<D>& out) {
  double edge_sq = 0;
  for (const uint32_t other : OthersOf(open_[first_at_[place]].key)) {
    edge_sq = std::max(edge_sq, DistanceSq<D>(columns_.point(other), columns_.point(place)));
  }
  const double usual = kEdges * std::sqrt(edge_sq);
  Gather(place, needed_radius_ > 0 ? std::min(kMargin * needed_radius_, usual) : usual);
  needed_radius_ = 0;
  while (first_at_[place] != kNone) {
    const uint32_t at = first_at_[place];
    const auto [key, next] = open_[at];
    first_at_[place] = next;
    open_[at].next = unused_;
    unused_ = at;
    --open_count_;
    const std::array<uint32_t, D - 1> others = OthersOf(key);
    FacetBall<D> ball;
    const uint32_t apex = FindApex(place, others, IsFlipped(key), ball);
    Corners corners;
    corners[0] = place;
    std::copy(others.begin(), others.end(), corners.begin() + 1);
    corners[D] = apex;
    if (IsFlipped(key)) {
      std::swap(corners[0], corners[1]);
    }
    const bool is_precise = ball.error <= 0x1p-24 * ball.radius;
    AddSimplex(corners, D, is_precise ? ball.radius * ball.radius : std::numeric_limits<double>::infinity(), out);
  }
}

// The star of a vertex that no walk has come to.
template <int D>
void FacetWalk<D>::AddCellOf(uint32_t place, SimplexList<D>& out) {
  const VertexId v = columns_.vertex(place);
  structure_->Voronoi(v, workspace_);
  counters_.decisions.exact += workspace_.cell.counters().exact;
  counters_.decisions.perturbed += workspace_.cell.counters().perturbed;
  for (const CellNode<D>& node : workspace_.cell.nodes()) {
    Corners corners;
    corners[0] = place;
    Simplex<D> points;
    points[0] = structure_->point(v);
    bool is_simplex = true;
    for (int k = 0; k < D && is_simplex; ++k) {
      const Plane<D>& plane = workspace_.cell.plane(node.planes[k]);
      is_simplex = plane.kind == PlaneKind::kBisector;
      if (is_simplex) {
        corners[k + 1] = columns_.PlaceOf(plane.vertex);
        points[k + 1] = structure_->point(plane.vertex);
      }
    }
    if (is_simplex) {
      if (Orientation<D>(points).sign == Sign::kNegative) {
        std::swap(corners[D - 1], corners[D]);
      }
      AddSimplex(corners, -1, std::numeric_limits<double>::infinity(), out);
    }
  }
}

template <int D>
void FacetWalk<D>::Gather(uint32_t place, double radius) {
  near_radius_ = radius;
  const uint64_t leaves = columns_.Gather(columns_.point(place), radius, place, near_);
  counters_.leaves += leaves;
  counters_.vertices += near_.size();
  counters_.max_leaves = std::max(counters_.max_leaves, leaves);
}

// The vertex on the positive side of a facet whose ball holds no other, and that ball.
//
// A first one is found in doubles. If its ball holds vertices, or may hold some, these are tried one after the other: the ball through the facet
// and any vertex on the positive side holds the one that is looked for, and so does that through the next vertex found in it; so balls
// shrink, and what has been left out stays outside. On the negative side a ball holds nothing, since it lies in that of the simplex there.
template <int D>
uint32_t FacetWalk<D>::FindApex(uint32_t place, const std::array<uint32_t, D - 1>& others, bool is_flipped,
                                FacetBall<D>& ball) {
  const Point<D> site = columns_.point(place);
  std::array<Point<D>, D - 1> points;
  for (int j = 0; j < D - 1; ++j) {
    points[j] = columns_.point(others[j]);
  }
  const FacetPencil<D> pencil(site, points, is_flipped);
  const double normal_length = std::sqrt(NormSq<D>(pencil.normal()));
  for (;;) {
    size_t apex = near_.FindLowest(pencil, kLeastHeight * normal_length * near_radius_);
    if (apex == near_.kNone || pencil.SideOf(columns_.point(near_.place(apex))) != Sign::kPositive) {
      apex = FindSomeApex(pencil);
    }
    if (apex == near_.kNone) {
      if (!columns_.IsCovered(site, near_radius_)) {
        columns_.Widen();
      } else if (!std::isfinite(near_radius_)) {
        std::abort();  // the box has a corner beyond any facet that is not on it
      }
      Gather(place, 2 * near_radius_);
      continue;
    }
    Point<D> position = columns_.point(near_.place(apex));
    ball = pencil.BallThrough(position);
    const double reach = ball.Reach();
    Point<D> centre;
    for (int i = 0; i < D; ++i) {
      centre[i] = site[i] + 0.5 * ball.twice_centre[i];
    }
    if (!columns_.IsCovered(centre, reach)) {
      columns_.Widen();
      Gather(place, std::max(near_radius_, 2 * kMargin * reach));
      continue;
    }
    if (2 * reach > near_radius_) {
      Gather(place, 2 * kMargin * reach);
      continue;
    }
    ++counters_.cuts;
    // The other vertices of the facet and the apex are among them.
    if (near_.CountInside(ball) > D) {
      for (size_t i = 0; i < near_.size(); ++i) {
        const uint32_t u = near_.place(i);
        const double power = near_.PowerOf(i, ball);
        if (power >= ball.doubt || i == apex || std::find(others.begin(), others.end(), u) != others.end()) {
          continue;
        }
        const Point<D> candidate = columns_.point(u);
        if (power >= -ball.doubt) {
          const ExactDecision decision = pencil.IsInside(position, candidate);
          ++counters_.decisions.exact;
          counters_.decisions.perturbed += decision.perturbed ? 1 : 0;
          if (decision.sign != Sign::kPositive) {
            continue;
          }
        }
        apex = i;
        position = candidate;
        ball = pencil.BallThrough(position);
      }
    }
    needed_radius_ = std::max(needed_radius_, 2 * ball.Reach());
    return near_.place(apex);
  }
}

// Any vertex on the positive side.
template <int D>
size_t FacetWalk<D>::FindSomeApex(const FacetPencil<D>& pencil) const {
  for (size_t i = 0; i < near_.size(); ++i) {
    if (pencil.SideOf(columns_.point(near_.place(i))) == Sign::kPositive) {
      return i;
    }
  }
  return near_.kNone;
}

// Opens or closes all facets of a simplex but for the `known_facet`, which the walk came across.
template <int D>
void FacetWalk<D>::AddSimplex(const Corners& corners, int known_facet, double radius_sq, SimplexList<D>& out) {
  std::array<FaceMask, D + 1> faces;
  uint32_t lowest = std::numeric_limits<uint32_t>::max();
  bool is_ours = false;
  std::array<uint32_t, D + 1> indices;
  for (int i = 0; i <= D; ++i) {
    faces[i] = structure_->faces(columns_.vertex(corners[i]));
    indices[i] = OutputIndex(corners[i]);
    const bool is_own = corners[i] < own_count_;
    if (is_own) {
      has_simplices_[corners[i]] = 1;
    }
    if (indices[i] < lowest) {
      lowest = indices[i];
      is_ours = is_own;
    }
  }
  constexpr std::array<std::array<int, D>, D + 1> kOutward = OutwardFacets<D>();
  for (int i = 0; i <= D; ++i) {
    if (i == known_facet) {
      continue;
    }
    FaceMask common = static_cast<FaceMask>(~0u);
    std::array<uint32_t, D> facet;
    for (int j = 0; j < D; ++j) {
      facet[j] = corners[kOutward[i][j]];
      common &= faces[kOutward[i][j]];
    }
    const int first = static_cast<int>(std::min_element(facet.begin(), facet.end()) - facet.begin());
    if (common != 0 || facet[first] >= own_count_) {
      continue;
    }
    std::array<uint32_t, D - 1> others;
    for (int j = 0; j < D - 1; ++j) {
      others[j] = facet[(first + 1 + j) % D];
    }
    ToggleFacet(facet[first], KeyOf(others, D == 2 && first == 1));
  }
  if (is_ours) {
    Simplex<D> points;
    for (int i = 0; i <= D; ++i) {
      points[i] = columns_.point(corners[i]);
    }
    out.Add(points, indices, radius_sq);
  }
}

// Closes the facet if it is open from the other side, and opens it otherwise.
template <int D>
void FacetWalk<D>::ToggleFacet(uint32_t place, Key key) {
  const Key opposite = Opposite(key);
  for (uint32_t* link = &first_at_[place]; *link != kNone; link = &open_[*link].next) {
    const uint32_t at = *link;
    if (open_[at].key == opposite) {
      *link = open_[at].next;
      open_[at].next = unused_;
      unused_ = at;
      --open_count_;
      return;
    }
  }
  uint32_t at = unused_;
  if (at == kNone) {
    at = static_cast<uint32_t>(open_.size());
    open_.emplace_back();
  } else {
    unused_ = open_[at].next;
  }
  ++open_count_;
  open_[at] = {key, first_at_[place]};
  first_at_[place] = at;
}

template class FacetWalk<2>;
template class FacetWalk<3>;

}  // namespace wellspace::core
