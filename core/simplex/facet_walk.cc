#include "core/simplex/facet_walk.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace wellspace::core {
namespace {

// Vertices near a site are gathered up to so many times the radius that the star before has needed,
constexpr double kMargin = 1.05;
// but not farther than so many times the longest edge of a facet: leaves are looked at for the balls that reach farther.
constexpr double kEdges = 2.5;
// Where more leaves than these lie within the radius of a gathering, the cell tells the apexes: small leaves about a large star.
template <int D>
constexpr size_t kMostSurroundings = D == 2 ? 64 : 1024;
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
        CloseFacetsAt(leaf, place, out);
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
  needed_radius_ = 0;
}

template <int D>
void FacetWalk<D>::CloseFacetsAt(NodeId leaf, uint32_t place, SimplexList<D>& out) {
  double edge_sq = 0;
  for (const uint32_t other : OthersOf(open_[first_at_[place]].key)) {
    edge_sq = std::max(edge_sq, DistanceSq<D>(columns_.point(other), columns_.point(place)));
  }
  // A ball through the facet reaches as far as its edge at least.
  const double edge = std::sqrt(edge_sq);
  const double radius = needed_radius_ > 0 ? std::clamp(kMargin * needed_radius_, edge, kEdges * edge) : kEdges * edge;
  const bool is_gathered = Gather(leaf, place, radius);
  if (is_gathered) {
    needed_radius_ = 0;
  } else {
    ComputeCell(place);
  }
  while (first_at_[place] != kNone) {
    const uint32_t at = first_at_[place];
    const auto [key, next] = open_[at];
    first_at_[place] = next;
    open_[at].next = unused_;
    unused_ = at;
    --open_count_;
    const Facet facet{place, OthersOf(key), IsFlipped(key)};
    FacetBall<D> ball = FacetBall<D>::Everything();
    const uint32_t apex = is_gathered ? FindApex(leaf, facet, ball) : ApexInCell(facet);
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

// Puts the simplices of a vertex into cell_.
template <int D>
void FacetWalk<D>::ComputeCell(uint32_t place) {
  structure_->Voronoi(columns_.vertex(place), workspace_);
  cell_.clear();
  for (const CellNode<D>& node : workspace_.cell.nodes()) {
    std::array<uint32_t, D> others;
    bool is_simplex = true;
    for (int k = 0; k < D && is_simplex; ++k) {
      const Plane<D>& plane = workspace_.cell.plane(node.planes[k]);
      is_simplex = plane.kind == PlaneKind::kBisector;
      if (is_simplex) {
        others[k] = columns_.PlaceOf(plane.vertex);
      }
    }
    if (is_simplex) {
      cell_.push_back(others);
    }
  }
}

// The star of a vertex that no walk has come to.
template <int D>
void FacetWalk<D>::AddCellOf(uint32_t place, SimplexList<D>& out) {
  ComputeCell(place);
  for (const std::array<uint32_t, D>& others : cell_) {
    Corners corners;
    corners[0] = place;
    std::copy(others.begin(), others.end(), corners.begin() + 1);
    Simplex<D> points;
    for (int i = 0; i <= D; ++i) {
      points[i] = columns_.point(corners[i]);
    }
    if (Orientation<D>(points).sign == Sign::kNegative) {
      std::swap(corners[D - 1], corners[D]);
    }
    AddSimplex(corners, -1, std::numeric_limits<double>::infinity(), out);
  }
}

// False, and nothing gathered, when there is too much around the leaf.
template <int D>
bool FacetWalk<D>::Gather(NodeId leaf, uint32_t place, double radius) {
  if (!columns_.Surround(leaf, radius, kMostSurroundings<D>)) {
    return false;
  }
  near_radius_ = radius;
  const uint64_t leaves = columns_.Gather(columns_.point(place), radius, place, near_);
  counters_.leaves += leaves;
  counters_.vertices += near_.size();
  counters_.max_leaves = std::max(counters_.max_leaves, leaves);
  return true;
}

// The vertex on the positive side of a facet that one of the simplices in cell_, those of the facet's site, has besides the facet's.
template <int D>
uint32_t FacetWalk<D>::ApexInCell(const Facet& facet) {
  std::array<Point<D>, D - 1> points;
  for (int j = 0; j < D - 1; ++j) {
    points[j] = columns_.point(facet.others[j]);
  }
  const FacetPencil<D> pencil(columns_.point(facet.place), points, facet.is_flipped);
  for (const std::array<uint32_t, D>& others : cell_) {
    uint32_t apex = kNone;
    int common = 0;
    for (const uint32_t other : others) {
      if (std::find(facet.others.begin(), facet.others.end(), other) != facet.others.end()) {
        ++common;
      } else {
        apex = other;
      }
    }
    if (common == D - 1 && pencil.SideOf(columns_.point(apex)) == Sign::kPositive) {
      return apex;
    }
  }
  std::abort();  // a facet that is not on the box has simplices on both sides
}

// The vertex on the positive side of a facet at a vertex in `leaf` whose ball holds no other, and that ball.
//
// A first one is found in doubles. If its ball holds vertices, or may hold some, these are tried one after the other: the ball through the facet
// and any vertex on the positive side holds the one that is looked for, and so does that through the next vertex found in it; so balls
// shrink, and what has been left out stays outside. On the negative side a ball holds nothing, since it lies in that of the simplex there.
// Each vertex is tried once, and each leaf looked at once, whatever rounding does.
template <int D>
uint32_t FacetWalk<D>::FindApex(NodeId leaf, const Facet& facet, FacetBall<D>& ball) {
  std::array<Point<D>, D - 1> points;
  for (int j = 0; j < D - 1; ++j) {
    points[j] = columns_.point(facet.others[j]);
  }
  const FacetPencil<D> pencil(columns_.point(facet.place), points, facet.is_flipped);
  const double normal_length = std::sqrt(NormSq<D>(pencil.normal()));
  const uint32_t first = near_.FindLowest(pencil, kLeastHeight * normal_length * near_radius_);
  uint32_t apex = kNone;
  ball = FacetBall<D>::Everything();
  if (first != near_.kNone && pencil.SideOf(columns_.point(near_.place(first))) == Sign::kPositive) {
    apex = near_.place(first);
    ball = pencil.BallThrough(columns_.point(apex));
  }
  if (2 * ball.Reach() <= near_radius_) {
    SearchNear(pencil, facet, apex, ball);
  } else {
    SearchLeaves(leaf, pencil, facet, apex, ball);
  }
  ++counters_.cuts;
  needed_radius_ = std::max(needed_radius_, 2 * ball.Reach());
  return apex;
}

// Makes the ball that through `u` if it is inside, or if it is on the positive side when there is no apex yet; its power, as computed, is below
// the doubt.
template <int D>
bool FacetWalk<D>::Shrink(const FacetPencil<D>& pencil, const Facet& facet, uint32_t u, double power, uint32_t& apex,
                          FacetBall<D>& ball) {
  if (u == apex || u == facet.place || std::find(facet.others.begin(), facet.others.end(), u) != facet.others.end()) {
    return false;
  }
  const Point<D> position = columns_.point(u);
  if (apex == kNone) {
    if (pencil.SideOf(position) != Sign::kPositive) {
      return false;
    }
  } else if (power >= -ball.doubt) {
    const ExactDecision decision = pencil.IsInside(columns_.point(apex), position);
    ++counters_.decisions.exact;
    counters_.decisions.perturbed += decision.perturbed ? 1 : 0;
    if (decision.sign != Sign::kPositive) {
      return false;
    }
  }
  apex = u;
  ball = pencil.BallThrough(position);
  return true;
}

// Shrinks a ball that lies among the gathered vertices.
template <int D>
void FacetWalk<D>::SearchNear(const FacetPencil<D>& pencil, const Facet& facet, uint32_t& apex, FacetBall<D>& ball) {
  // The other vertices of the facet and the apex are inside, as far as doubles tell.
  if (near_.CountInside(ball) > D) {
    for (size_t i = 0; i < near_.size(); ++i) {
      const double power = near_.PowerOf(i, ball);
      if (power < ball.doubt) {
        Shrink(pencil, facet, near_.place(i), power, apex, ball);
      }
    }
  }
}

// Shrinks any ball, by the leaves that it comes to on the positive side: those of the surroundings, if they cover it, else
// by going from leaf to leaf.
//
// That part of the last ball is convex and touches the vertex, so that a path from there leads to each leaf that it comes to, through facets of
// such leaves alone; and it lies in the same part of every ball before.
template <int D>
void FacetWalk<D>::SearchLeaves(NodeId leaf, const FacetPencil<D>& pencil, const Facet& facet, uint32_t& apex,
                                FacetBall<D>& ball) {
  const Point<D> site = columns_.point(facet.place);
  const auto shrink = [&](uint32_t u, double power) { return Shrink(pencil, facet, u, power, apex, ball); };
  const auto may_hold = [&](const Box<D>& box) { return pencil.MayHold(box, columns_.rounding()); };
  if (columns_.Covers(site, ball)) {
    counters_.leaves += columns_.ForEachInsideSurroundings(site, ball, may_hold, shrink);
    return;
  }
  const auto meets = [&](const Box<D>& box) {
    const Point<D> centre = ball.Centre();
    double distance_sq = 0;
    for (int i = 0; i < D; ++i) {
      const double gap = std::max({box.low[i] - site[i] - centre[i], centre[i] - (box.high[i] - site[i]), 0.0});
      distance_sq += gap * gap;
    }
    const double reach = ball.Reach() + 2 * columns_.rounding();
    return distance_sq <= reach * reach && may_hold(box);
  };
  uint64_t leaves = 0;
  columns_.LookOutward(leaf, meets, [&](NodeId near) {
    ++leaves;
    counters_.vertices += columns_.ForEachInside(near, site, ball, shrink);
  });
  counters_.leaves += leaves;
  counters_.max_leaves = std::max(counters_.max_leaves, leaves);
  if (apex == kNone) {
    std::abort();  // the box has a corner beyond any facet that is not on it
  }
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
