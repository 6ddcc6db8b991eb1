#include "core/sliver/triangulation.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/sort_few.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {
namespace {

// Simplices or vertices between two looks at the context.
constexpr size_t kCheckInterval = 4096;
// There is room for one more in so many simplices before they have to be moved.
constexpr size_t kRoomToGrow = 16;

// The slots of the lowest vertex and the second.
template <int D>
std::pair<int, int> LowestSlots(const std::array<VertexId, D + 1>& vertices) {
  int lowest = 0;
  int second = 1;
  for (int i = 1; i <= D; ++i) {
    const bool is_lowest = vertices[i] < vertices[lowest];
    second = is_lowest ? lowest : i == 1 || vertices[i] < vertices[second] ? i : second;
    lowest = is_lowest ? i : lowest;
  }
  return {lowest, second};
}

// The facets that have one vertex in common, by their others: each is that of two simplices, or on the box.
template <int D>
class FacetTable {
 public:
  // Makes room for that many facets.
  void Clear(size_t facets) {
    const size_t size = std::bit_ceil(std::max<size_t>(facets + 1, 2));
    shift_ = std::countl_zero(size) + 1;
    entries_.assign(size, {});
  }

  // The simplex and slot that the facet was added with; kNoSimplex if it is added now.
  std::pair<SimplexId, int> FindOrAdd(const std::array<VertexId, D - 1>& others, SimplexId s, int slot) {
    uint64_t hash = 0;
    for (const VertexId u : others) {
      hash = (hash + Index(u) + 1) * 0x9e3779b97f4a7c15;
    }
    size_t at = hash >> shift_;
    while (entries_[at].simplex != kNoSimplex && entries_[at].others != others) {
      at = (at + 1) % entries_.size();
    }
    if (entries_[at].simplex != kNoSimplex) {
      return {entries_[at].simplex, entries_[at].slot};
    }
    entries_[at] = {others, s, slot};
    return {kNoSimplex, 0};
  }

 private:
  struct Entry {
    std::array<VertexId, D - 1> others{};  // ascending
    SimplexId simplex = kNoSimplex;
    int slot = 0;
  };
  std::vector<Entry> entries_;  // a power of two of them; one that is taken is followed by those that found it so
  int shift_ = 0;
};

}  // namespace

template <int D>
absl::Status Triangulation<D>::Build(const Box<D>& box, HugeVector<Point<D>> points,
                                     std::span<const uint32_t> simplices, int threads, const RunContext& context) {
  box_ = box;
  points_ = std::move(points);
  weights_.assign(points_.size(), 0);
  faces_.clear();
  faces_.reserve(points_.size());
  for (const Point<D>& p : points_) {
    faces_.push_back(box_.FacesOf(p));
  }
  simplex_of_.assign(points_.size(), kNoSimplex);
  if (simplices.size() > std::numeric_limits<uint32_t>::max()) {
    return absl::ResourceExhaustedError(absl::StrCat("a mesh of ", simplices.size() / (D + 1),
                                                     " simplices is too large to be repaired or pumped; at most ",
                                                     std::numeric_limits<uint32_t>::max() / (D + 1), " are accepted"));
  }
  WELLSPACE_RETURN_IF_ERROR(TakeSimplices(simplices, context));
  return MatchFacets(threads, context);
}

template <int D>
absl::Status Triangulation<D>::TakeSimplices(std::span<const uint32_t> simplices, const RunContext& context) {
  const size_t count = simplices.size() / (D + 1);
  items_.reserve(count + count / kRoomToGrow);
  items_.assign(count, {});
  free_.clear();
  planes_.assign(kKnownPlanes, {});
  mark_.assign(count, 0);
  stamp_ = 0;
  for (size_t s = 0; s < count; ++s) {
    if (s % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    for (int i = 0; i <= D; ++i) {
      const VertexId v{simplices[s * (D + 1) + i]};
      items_[s].vertices[i] = v;
      simplex_of_[Index(v)] = SimplexId{static_cast<uint32_t>(s)};
    }
    items_[s].neighbours.fill(kNoSimplex);
  }
  return absl::OkStatus();
}

// Finds the neighbours of all simplices. Facets are sorted by their lowest vertex: those of one vertex are few, and are
// matched among themselves. The lowest vertex of a simplex is that of all its facets but the one opposite to it, which
// has the second.
template <int D>
absl::Status Triangulation<D>::MatchFacets(int threads, const RunContext& context) {
  const size_t count = items_.size();
  HugeVector<uint32_t> next(points_.size() + 1, 0);  // by vertex
  for (size_t s = 0; s < count; ++s) {
    if (s % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const auto& vertices = items_[s].vertices;
    const auto [lowest, second] = LowestSlots<D>(vertices);
    ++next[Index(vertices[lowest]) + 1];
    ++next[Index(vertices[second]) + 1];
  }
  std::partial_sum(next.begin(), next.end(), next.begin());
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  HugeVector<uint32_t> with_lowest(2 * count);  // twice a simplex, and one where its opposite facet is meant
  for (size_t s = 0; s < count; ++s) {
    if (s % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const auto& vertices = items_[s].vertices;
    const auto [lowest, second] = LowestSlots<D>(vertices);
    with_lowest[next[Index(vertices[lowest])]++] = static_cast<uint32_t>(2 * s);
    with_lowest[next[Index(vertices[second])]++] = static_cast<uint32_t>(2 * s + 1);
  }
  // Joins the facet opposite to `slot`, if its twin has been there.
  const auto join = [&](FacetTable<D>& table, size_t v, SimplexId s, int slot) {
    Item& item = items_[Index(s)];
    std::array<VertexId, D - 1> others;
    for (int i = 0, to = 0; i <= D; ++i) {
      if (i != slot && Index(item.vertices[i]) != v) {
        others[to++] = item.vertices[i];
      }
    }
    SortFew(others);
    if (const auto [twin, twin_slot] = table.FindOrAdd(others, s, slot); twin != kNoSimplex) {
      item.neighbours[slot] = twin;
      items_[Index(twin)].neighbours[twin_slot] = s;
    }
  };
  // next[v] is where those of v end. A facet has one lowest vertex, so nothing is written by two threads.
  ThreadTeam team(threads);
  return team.TryForEach((points_.size() + kCheckInterval - 1) / kCheckInterval, [&](size_t block) {
    FacetTable<D> table;
    const size_t end = std::min(points_.size(), (block + 1) * kCheckInterval);
    for (size_t v = block * kCheckInterval; v < end; ++v) {
      const uint32_t begin = v == 0 ? 0 : next[v - 1];
      table.Clear(size_t{next[v] - begin} * D);
      for (uint32_t k = begin; k < next[v]; ++k) {
        const SimplexId s{with_lowest[k] / 2};
        const bool is_opposite = with_lowest[k] % 2 != 0;
        const int lowest = LowestSlots<D>(items_[Index(s)].vertices).first;
        for (int slot = 0; slot <= D; ++slot) {
          if ((slot == lowest) == is_opposite) {
            join(table, v, s, slot);
          }
        }
      }
    }
    return context.Check();
  });
}

template <int D>
void Triangulation<D>::StartSearch() {
  if (stamp_ > std::numeric_limits<uint32_t>::max() - 4) {
    std::fill(mark_.begin(), mark_.end(), 0);
    stamp_ = 0;
  }
  stamp_ += 2;
}

template <int D>
SimplexId Triangulation<D>::Allocate() {
  if (free_.empty()) {
    items_.emplace_back();
    mark_.push_back(0);
    free_.push_back(SimplexId{static_cast<uint32_t>(items_.size() - 1)});
  }
  const SimplexId s = free_.back();
  free_.pop_back();
  journal_.Note(Index(s));
  return s;
}

template <int D>
void Triangulation<D>::Free(SimplexId s) {
  items_[Index(s)].vertices[0] = kNoVertex;
  mark_[Index(s)] = 0;
  if (KnownPlane& known = planes_[Index(s) % kKnownPlanes]; known.simplex == s) {
    known.simplex = kNoSimplex;
  }
  free_.push_back(s);
  journal_.Note(Index(s));
}

template <int D>
VertexId Triangulation<D>::AddVertex() {
  points_.emplace_back();
  faces_.push_back(0);
  weights_.push_back(0);
  simplex_of_.push_back(kNoSimplex);
  return VertexId{vertex_count() - 1};
}

template <int D>
absl::StatusOr<HugeVector<double>> Triangulation<D>::NearestDistancesSq(const RunContext& context) const {
  HugeVector<double> nearest_sq(points_.size(), std::numeric_limits<double>::infinity());
  for (size_t s = 0; s < items_.size(); ++s) {
    if (s % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    if (!IsIn(SimplexId{static_cast<uint32_t>(s)})) {
      continue;
    }
    const auto& vertices = items_[s].vertices;
    for (int i = 1; i <= D; ++i) {
      for (int j = 0; j < i; ++j) {
        const double edge_sq = DistanceSq<D>(point(vertices[i]), point(vertices[j]));
        nearest_sq[Index(vertices[i])] = std::min(nearest_sq[Index(vertices[i])], edge_sq);
        nearest_sq[Index(vertices[j])] = std::min(nearest_sq[Index(vertices[j])], edge_sq);
      }
    }
  }
  return nearest_sq;
}

template <int D>
void Triangulation<D>::Star(VertexId v, std::vector<SimplexId>& out) {
  StartSearch();
  out.assign(1, simplex_of_[Index(v)]);
  mark_[Index(out[0])] = stamp_;
  for (size_t k = 0; k < out.size(); ++k) {
    const Item& item = items_[Index(out[k])];
    const size_t count = out.size();
    out.resize(count + D + 1);
    size_t to = count;
    for (int i = 0; i <= D; ++i) {
      const SimplexId next = item.neighbours[i];
      const bool may_be_new = item.vertices[i] != v && next != kNoSimplex;
      uint32_t& mark = mark_[may_be_new ? Index(next) : Index(out[0])];
      out[to] = next;
      to += mark != stamp_ ? 1 : 0;
      mark = stamp_;
    }
    out.resize(to);
  }
}

template <int D>
LiftedPlane<D> Triangulation<D>::PlaneOf(const std::array<VertexId, D + 1>& vertices) const {
  Simplex<D> corners;
  std::array<double, D + 1> weights;
  for (int i = 0; i <= D; ++i) {
    corners[i] = point(vertices[i]);
    weights[i] = weight(vertices[i]);
  }
  return {corners, weights};
}

template <int D>
bool Triangulation<D>::IsInConflict(SimplexId s, const Point<D>& p, double weight) {
  const std::array<VertexId, D + 1>& vertices = items_[Index(s)].vertices;
  KnownPlane& known = planes_[Index(s) % kKnownPlanes];
  if (known.simplex != s) {
    known = {s, PlaneOf(vertices)};
  }
  return IsInConflict(vertices, known.plane, p, weight);
}

// IsInConflict for a positively oriented simplex of `vertices`, which has that plane.
template <int D>
bool Triangulation<D>::IsInConflict(const std::array<VertexId, D + 1>& vertices, const LiftedPlane<D>& plane,
                                    const Point<D>& p, double weight) const {
  if (const int side = plane.SideOf(p, weight); side != 0) {
    return side > 0;
  }
  std::array<PlaneSource<D>, D> planes;
  DecisionWeights<D> weights{.site = this->weight(vertices[0]), .generators = {}, .u = weight};
  bool is_weighted = weights.site != 0 || weight != 0;
  for (int i = 0; i < D; ++i) {
    planes[i].generator = point(vertices[i + 1]);
    weights.generators[i] = this->weight(vertices[i + 1]);
    is_weighted = is_weighted || weights.generators[i] != 0;
  }
  const Point<D>& site = point(vertices[0]);
  const ExactDecision decision = is_weighted ? DecidePowerCut<D>(site, planes, p, weights, TieRule::kPerturb)
                                             : DecideCut<D>(site, planes, p, TieRule::kPerturb);
  return decision.sign == Sign::kPositive;
}

template <int D>
FaceMask Triangulation<D>::FacesOf(const std::array<VertexId, D + 1>& vertices, int opposite) const {
  auto shared = static_cast<FaceMask>(~0u);
  for (int i = 0; i <= D; ++i) {
    shared = i == opposite ? shared : static_cast<FaceMask>(shared & faces(vertices[i]));
  }
  return shared;
}

template <int D>
SimplexId Triangulation<D>::Locate(const Point<D>& p, VertexId start) const {
  // Through a facet that p is beyond; in a Delaunay triangulation that never comes back.
  SimplexId at = simplex_of_[Index(start)];
  while (true) {
    const Item& item = items_[Index(at)];
    const Simplex<D> corners = Corners(at);
    SimplexId next = kNoSimplex;
    for (int i = 0; i <= D && next == kNoSimplex; ++i) {
      Simplex<D> replaced = corners;
      replaced[i] = p;
      if (item.neighbours[i] != kNoSimplex && Orientation<D>(replaced).sign == Sign::kNegative) {
        next = item.neighbours[i];
      }
    }
    if (next == kNoSimplex) {
      return at;
    }
    at = next;
  }
}

template <int D>
void Triangulation<D>::FindCavityOfWeight(VertexId v, double weight, Cavity& out) {
  Star(v, out.simplices);
  Grow(point(v), weight, faces(v), out, [](const Cavity::Facet&) { return false; });
}

template <int D>
void Triangulation<D>::Insert(VertexId v, const Point<D>& p, double weight, const Cavity& cavity,
                              std::vector<SimplexId>& created) {
  points_[Index(v)] = p;
  faces_[Index(v)] = box_.FacesOf(p);
  weights_[Index(v)] = weight;
  created.clear();
  for (const auto& [s, slot] : cavity.boundary) {
    const SimplexId fresh = Allocate();
    created.push_back(fresh);
    Item& item = items_[Index(fresh)];
    item.vertices = items_[Index(s)].vertices;
    item.vertices[slot] = v;
    item.neighbours.fill(kNoSimplex);
    const SimplexId beyond = items_[Index(s)].neighbours[slot];
    item.neighbours[slot] = beyond;
    if (beyond != kNoSimplex) {
      Item& other = items_[Index(beyond)];
      other.neighbours[other.SlotOf(s)] = fresh;
    }
    // So that a turn about a ridge inside the cavity comes upon it.
    items_[Index(s)].neighbours[slot] = fresh;
    for (const VertexId u : item.vertices) {
      simplex_of_[Index(u)] = fresh;
    }
  }
  // The neighbour across the facet without vertex j: turn about the ridge of the old facet without j, inside the
  // cavity, until its boundary.
  for (size_t k = 0; k < created.size(); ++k) {
    const auto [s, slot] = cavity.boundary[k];
    for (int j = 0; j <= D; ++j) {
      if (j == slot) {
        continue;
      }
      SimplexId at = s;
      VertexId entered_by = items_[Index(s)].vertices[slot];
      SimplexId next = items_[Index(at)].neighbours[j];
      while (next != kNoSimplex && IsInCavity(next)) {
        const Item& item = items_[Index(next)];
        const VertexId beyond = item.vertices[item.SlotOf(at)];
        at = next;
        next = item.neighbours[item.SlotOf(entered_by)];
        entered_by = beyond;
      }
      items_[Index(created[k])].neighbours[j] = next;
    }
  }
  for (const SimplexId s : cavity.simplices) {
    Free(s);
  }
}

template <int D>
void Triangulation<D>::Remove(VertexId v, std::vector<SimplexId>& created) {
  Star(v, star_);
  journal_size_ = journal_.size();
  open_.clear();
  open_keys_.clear();
  saved_.clear();
  filling_.clear();
  link_.clear();
  link_columns_.Clear();
  link_number_.resize(points_.size());
  for (const SimplexId s : star_) {
    const Item& item = items_[Index(s)];
    Open open{{}, item.SlotOf(v), kNoSimplex, 0, {}};
    for (int i = 0; i <= D; ++i) {
      open.vertices[i] = i == open.slot ? 0 : NumberInLink(item.vertices[i], v);
    }
    open.beyond = item.neighbours[open.slot];
    if (open.beyond != kNoSimplex) {
      open.beyond_slot = items_[Index(open.beyond)].SlotOf(s);
    }
    saved_.push_back({s, open.beyond_slot, item});
    open.facet = FacetOf(open.vertices, open.slot);
    PushOpen(open);
  }
  for (const SimplexId s : star_) {
    Free(s);
  }
  simplex_of_[Index(v)] = kNoSimplex;
  removed_ = v;
  while (!open_.empty()) {
    const Open open = TakeOpen(open_.size() - 1);
    const SimplexId fresh = Allocate();
    filling_.push_back(fresh);
    std::array<uint32_t, D + 1> vertices = open.vertices;
    vertices[open.slot] = Wrap(open, fresh);
    Item& item = items_[Index(fresh)];
    for (int i = 0; i <= D; ++i) {
      item.vertices[i] = link_[vertices[i]];
      simplex_of_[Index(item.vertices[i])] = fresh;
    }
    item.neighbours.fill(kNoSimplex);
    item.neighbours[open.slot] = open.beyond;
    if (open.beyond != kNoSimplex) {
      items_[Index(open.beyond)].neighbours[open.beyond_slot] = fresh;
    }
    for (int slot = 0; slot <= D; ++slot) {
      if (slot != open.slot) {
        LinkFacet(fresh, vertices, slot);
      }
    }
  }
  created = filling_;
}

// Where `u` is in link_; the last if it was not there.
template <int D>
uint32_t Triangulation<D>::NumberInLink(VertexId u, VertexId removed) {
  uint32_t& number = link_number_[Index(u)];
  if (number >= link_.size() || link_[number] != u) {
    number = static_cast<uint32_t>(link_.size());
    link_.push_back(u);
    if constexpr (D == 3) {
      link_columns_.Add(Difference<D>(point(u), point(removed)), weight(u));
    }
  }
  return number;
}

// The neighbour of the removed vertex, by its number in link_, that is to be joined to a facet of the hole by simplex
// `fresh`.
template <int D>
uint32_t Triangulation<D>::Wrap(const Open& open, SimplexId fresh) {
  if constexpr (D == 3) {
    std::array<uint32_t, 3> facet;
    for (int i = 0, to = 0; i < 4; ++i) {
      if (i != open.slot) {
        facet[to++] = open.vertices[i];
      }
    }
    if (open.slot % 2 == 0) {
      std::swap(facet[1], facet[2]);
    }
    if (const auto wrapped = link_columns_.Wrap(facet[0], facet[1], facet[2]); wrapped.has_value()) {
      const VertexId origin = link_[facet[0]];
      planes_[Index(fresh) % kKnownPlanes] = {fresh,
                                              {point(origin), weight(origin), wrapped->cofactors, wrapped->largest}};
      return wrapped->apex;
    }
  }
  std::array<VertexId, D + 1> vertices;
  Simplex<D> corners;
  for (int i = 0; i <= D; ++i) {
    vertices[i] = i == open.slot ? kNoVertex : link_[open.vertices[i]];
    corners[i] = i == open.slot ? Point<D>{} : point(vertices[i]);
  }
  uint32_t best = 0;
  LiftedPlane<D> plane;
  for (uint32_t number = 0; number < link_.size(); ++number) {
    const VertexId u = link_[number];
    if (std::find(vertices.begin(), vertices.end(), u) != vertices.end() ||
        (vertices[open.slot] != kNoVertex && !IsInConflict(vertices, plane, point(u), weight(u)))) {
      continue;
    }
    corners[open.slot] = point(u);
    if (Orientation<D>(corners).sign == Sign::kPositive) {
      best = number;
      vertices[open.slot] = u;
      plane = PlaneOf(vertices);
    }
  }
  if (vertices[open.slot] == kNoVertex) {
    std::abort();  // a hole in a box whose corners are vertices has a vertex on the inner side of each facet
  }
  return best;
}

// Joins a facet of a new simplex of the hole to the open facet that it closes, or opens it, unless it is on the box.
template <int D>
void Triangulation<D>::LinkFacet(SimplexId fresh, const std::array<uint32_t, D + 1>& vertices, int slot) {
  Item& item = items_[Index(fresh)];
  const std::array<uint32_t, D> facet = FacetOf(vertices, slot);
  const uint64_t key = KeyOf(facet);
  for (size_t k = 0; k < open_.size(); ++k) {
    if (open_keys_[k] == key && open_[k].facet == facet) {
      const Open open = TakeOpen(k);
      item.neighbours[slot] = open.beyond;
      if (open.beyond != kNoSimplex) {
        items_[Index(open.beyond)].neighbours[open.beyond_slot] = fresh;
      }
      return;
    }
  }
  if (FacesOf(item.vertices, slot) == 0) {
    // Seen from its other side.
    Open next{vertices, slot, fresh, slot, facet};
    std::swap(next.vertices[slot == 0 ? 1 : 0], next.vertices[slot <= 1 ? 2 : 1]);
    PushOpen(next);
  }
}

template <int D>
void Triangulation<D>::PushOpen(const Open& open) {
  open_.push_back(open);
  open_keys_.push_back(KeyOf(open.facet));
}

// Takes one out; the last takes its place.
template <int D>
auto Triangulation<D>::TakeOpen(size_t at) -> Open {
  const Open open = open_[at];
  open_[at] = open_.back();
  open_.pop_back();
  open_keys_[at] = open_keys_.back();
  open_keys_.pop_back();
  return open;
}

template <int D>
std::array<uint32_t, D> Triangulation<D>::FacetOf(const std::array<uint32_t, D + 1>& vertices, int opposite) {
  std::array<uint32_t, D> facet;
  for (int i = 0; i < D; ++i) {
    facet[i] = vertices[i + (i >= opposite ? 1 : 0)];
  }
  SortFew(facet);
  return facet;
}

template <int D>
void Triangulation<D>::Restore() {
  // The list of free numbers goes back to its earlier state, in reverse.
  for (auto it = filling_.rbegin(); it != filling_.rend(); ++it) {
    Free(*it);
  }
  free_.resize(free_.size() - saved_.size());
  journal_.Rewind(journal_size_);
  for (const auto& [s, beyond_slot, item] : saved_) {
    items_[Index(s)] = item;
    const SimplexId beyond = item.neighbours[item.SlotOf(removed_)];
    if (beyond != kNoSimplex) {
      items_[Index(beyond)].neighbours[beyond_slot] = s;
    }
    for (const VertexId u : item.vertices) {
      simplex_of_[Index(u)] = s;
    }
  }
}

#define WELLSPACE_INSTANTIATE(D) template class Triangulation<D>;
WELLSPACE_INSTANTIATE(3)
WELLSPACE_INSTANTIATE(4)
WELLSPACE_INSTANTIATE(5)
WELLSPACE_INSTANTIATE(6)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
