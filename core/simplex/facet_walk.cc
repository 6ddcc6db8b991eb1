#include "core/simplex/facet_walk.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace wellspace::core {
namespace {

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
void FacetWalk<D>::AppendStars(const QueryStructure<D>& structure, const NeighbourTable& neighbours,
                               std::span<const NodeId> leaves, std::span<const uint32_t> rank,
                               std::span<const uint32_t> output_index, const RunContext& context, SimplexList<D>& out) {
  Begin(structure, neighbours, leaves, rank, output_index);
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
    first += count;
    counters_.queries += count;
  }
}

// Walks until no facet is open; false when cancelled.
template <int D>
bool FacetWalk<D>::CloseFacets(std::span<const NodeId> leaves, const RunContext& context, SimplexList<D>& out) {
  while (open_count_ > 0) {
    uint32_t first = 0;
    for (const NodeId leaf : leaves) {
      const uint32_t end = first + structure_->tree().BucketOf(leaf)->count;
      bool is_first = true;
      // A star may open facets at vertices before it.
      for (uint32_t place = first; place < end;) {
        if (first_at_[place] == kNone) {
          ++place;
          continue;
        }
        if (is_first && context.IsCancelled()) {
          return false;
        }
        is_first = false;
        CloseFacetsAt(place, out);
        place = first;
      }
      first = end;
    }
  }
  return true;
}

template <int D>
void FacetWalk<D>::Begin(const QueryStructure<D>& structure, const NeighbourTable& neighbours,
                         std::span<const NodeId> leaves, std::span<const uint32_t> rank,
                         std::span<const uint32_t> output_index) {
  structure_ = &structure;
  neighbours_ = &neighbours;
  rank_ = rank;
  output_index_ = output_index;
  places_.clear();
  foreign_.clear();
  for (const NodeId leaf : leaves) {
    const auto* bucket = structure.tree().BucketOf(leaf);
    for (uint32_t i = 0; i < bucket->count; ++i) {
      places_.push_back({bucket->positions[i], bucket->ids[i]});
    }
  }
  first_rank_ = rank[Index(places_.front().vertex)];
  own_count_ = static_cast<uint32_t>(places_.size());
  facets_left_ = 0;
  for (const Place& own : places_) {
    facets_left_ += D * neighbours.CountAt(own.vertex);
  }
  first_at_.assign(own_count_, kNone);
  has_simplices_.assign(own_count_, 0);
  open_.clear();
  unused_ = kNone;
  open_count_ = 0;
}

// The place of a vertex, a new one if it has none.
template <int D>
uint32_t FacetWalk<D>::PlaceOf(VertexId v) {
  const uint32_t own = rank_[Index(v)] - first_rank_;  // wraps around for those before the block
  if (own < own_count_) {
    return own;
  }
  const auto [at, is_new] = foreign_.try_emplace(Index(v), static_cast<uint32_t>(places_.size()));
  if (is_new) {
    places_.push_back({structure_->point(v), v});
  }
  return at->second;
}

template <int D>
void FacetWalk<D>::CloseFacetsAt(uint32_t place, SimplexList<D>& out) {
  Gather(place);
  while (first_at_[place] != kNone) {
    const uint32_t at = first_at_[place];
    const auto [key, next] = open_[at];
    first_at_[place] = next;
    open_[at].next = unused_;
    unused_ = at;
    --open_count_;
    if (facets_left_-- == 0) {
      std::abort();  // a walk among all neighbours ends
    }
    const Facet facet{place, OthersOf(key), IsFlipped(key)};
    FacetBall<D> ball = FacetBall<D>::Everything();
    const uint32_t apex = FindApex(facet, ball);
    Corners corners;
    corners[0] = place;
    std::copy(facet.others.begin(), facet.others.end(), corners.begin() + 1);
    corners[D] = apex;
    if (facet.is_flipped) {
      std::swap(corners[0], corners[1]);
    }
    const bool is_precise = ball.error <= 0x1p-24 * ball.radius;
    AddSimplex(corners, D, is_precise ? ball.radius * ball.radius : std::numeric_limits<double>::infinity(), out);
  }
}

// The star of a vertex that no walk has come to.
template <int D>
void FacetWalk<D>::AddCellOf(uint32_t place, SimplexList<D>& out) {
  structure_->Voronoi(places_[place].vertex, workspace_);
  for (const CellNode<D>& node : workspace_.cell.nodes()) {
    Corners corners;
    corners[0] = place;
    bool is_simplex = true;
    for (int k = 0; k < D && is_simplex; ++k) {
      const Plane<D>& plane = workspace_.cell.plane(node.planes[k]);
      is_simplex = plane.kind == PlaneKind::kBisector;
      if (is_simplex) {
        corners[k + 1] = PlaceOf(plane.vertex);
      }
    }
    if (!is_simplex) {
      continue;
    }
    Simplex<D> points;
    for (int i = 0; i <= D; ++i) {
      points[i] = PointAt(corners[i]);
    }
    if (Orientation<D>(points).sign == Sign::kNegative) {
      std::swap(corners[D - 1], corners[D]);
    }
    AddSimplex(corners, -1, std::numeric_limits<double>::infinity(), out);
  }
}

// Puts the neighbours of a vertex, and some others, into near_.
template <int D>
void FacetWalk<D>::Gather(uint32_t place) {
  const Point<D> site = PointAt(place);
  double radius_sq = 0;
  near_.Clear();
  near_.Reserve(neighbours_->CountAt(places_[place].vertex));
  neighbours_->ForEachAt(places_[place].vertex, [&](VertexId v) {
    const uint32_t u = PlaceOf(v);
    const Point<D> w = Difference<D>(PointAt(u), site);
    std::array<double, D + 1> entry;
    std::copy(w.begin(), w.end(), entry.begin());
    entry[D] = NormSq<D>(w);
    radius_sq = std::max(radius_sq, entry[D]);
    near_.Append(u, entry);
  });
  near_.Finish();
  near_radius_ = std::sqrt(radius_sq);
  counters_.vertices += near_.size();
}

// The vertex on the positive side of a facet whose ball holds no other, and that ball. It is a neighbour of the site.
//
// A first one is found in doubles. If its ball holds neighbours, or may hold some, these are tried one after the other: the ball through the
// facet and any vertex on the positive side holds the one that is looked for, and so does that through the next vertex found in it; so balls
// shrink, and what has been left out stays outside. On the negative side a ball holds nothing, since it lies in that of the simplex there.
// Each vertex is tried once, whatever rounding does.
template <int D>
uint32_t FacetWalk<D>::FindApex(const Facet& facet, FacetBall<D>& ball) {
  std::array<Point<D>, D - 1> points;
  for (int j = 0; j < D - 1; ++j) {
    points[j] = PointAt(facet.others[j]);
  }
  const FacetPencil<D> pencil(PointAt(facet.place), points, facet.is_flipped);
  const double normal_length = std::sqrt(NormSq<D>(pencil.normal()));
  const uint32_t first = near_.FindLowest(pencil, kLeastHeight * normal_length * near_radius_);
  uint32_t apex = kNone;
  ball = FacetBall<D>::Everything();
  if (first != near_.kNone && pencil.SideOf(PointAt(near_.place(first))) == Sign::kPositive) {
    apex = near_.place(first);
    ball = pencil.BallThrough(PointAt(apex));
  }
  // The other vertices of the facet and the apex are inside, as far as doubles tell.
  if (near_.CountInside(ball) > D) {
    for (size_t i = 0; i < near_.size(); ++i) {
      const double power = near_.PowerOf(i, ball);
      if (power < ball.doubt) {
        Shrink(pencil, facet, near_.place(i), power, apex, ball);
      }
    }
  }
  if (apex == kNone) {
    std::abort();  // a facet that is not on the box has simplices on both sides
  }
  ++counters_.cuts;
  return apex;
}

// Makes the ball that through `u` if it is inside, or if it is on the positive side when there is no apex yet; its power, as computed, is below
// the doubt.
template <int D>
void FacetWalk<D>::Shrink(const FacetPencil<D>& pencil, const Facet& facet, uint32_t u, double power, uint32_t& apex,
                          FacetBall<D>& ball) {
  if (u == apex || u == facet.place || std::find(facet.others.begin(), facet.others.end(), u) != facet.others.end()) {
    return;
  }
  const Point<D> position = PointAt(u);
  if (apex == kNone) {
    if (pencil.SideOf(position) != Sign::kPositive) {
      return;
    }
  } else if (power >= -ball.doubt) {
    const ExactDecision decision = pencil.IsInside(PointAt(apex), position);
    ++counters_.decisions.exact;
    counters_.decisions.perturbed += decision.perturbed ? 1 : 0;
    if (decision.sign != Sign::kPositive) {
      return;
    }
  }
  apex = u;
  ball = pencil.BallThrough(position);
}

// Opens or closes all facets of a simplex but for the `known_facet`, which the walk came across.
template <int D>
void FacetWalk<D>::AddSimplex(const Corners& corners, int known_facet, double radius_sq, SimplexList<D>& out) {
  std::array<FaceMask, D + 1> faces;
  uint32_t lowest = std::numeric_limits<uint32_t>::max();
  bool is_ours = false;
  std::array<uint32_t, D + 1> indices;
  for (int i = 0; i <= D; ++i) {
    faces[i] = structure_->faces(places_[corners[i]].vertex);
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
      points[i] = PointAt(corners[i]);
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

template <int D>
QueryCounters FacetWalk<D>::counters() const {
  QueryCounters all = workspace_.counters;
  all.queries = 0;
  all.Add(counters_);
  return all;
}

template class FacetWalk<2>;
template class FacetWalk<3>;

}  // namespace wellspace::core
