#include "core/sliver/triangulation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/minors.h"

namespace wellspace::core {
namespace {

// Simplices or vertices between two looks at the context.
constexpr size_t kCheckInterval = 4096;
// There is room for one more in so many simplices before they have to be moved.
constexpr size_t kRoomToGrow = 16;

constexpr int Factorial(int n) { return n <= 1 ? 1 : n * Factorial(n - 1); }

// The sign of the in-sphere determinant is certain beyond this times m^(D + 2), m the largest difference of coordinates.
// Weights are at most a quarter of a squared edge, D (2 m)^2 / 4, so that the terms of a lifted entry add up to 3 D m^2;
// each of the (D + 1)! products passes through at most 6 (D + 1) roundings.
template <int D>
constexpr double kFilterBound = Factorial(D + 1) * 3.0 * D * 6 * (D + 1) * 0x1p-53;

// Doubles for MinorsOf.
struct DoubleRing {
  using Entry = double;
  template <int K>
  using Minor = double;
  static double ToMinor(double entry) { return entry; }
  static void AddProduct(double& sum, double factor, bool negate, double minor) {
    sum += negate ? -factor * minor : factor * minor;
  }
};

// det(e_i, lift_i): its sign is (-1)^D for the origin inside the sphere of a positively oriented simplex.
double LiftedDeterminant(const std::array<Point<3>, 4>& e, const std::array<double, 4>& lift) {
  const auto minor = [&](int i, int j) { return e[i][0] * e[j][1] - e[j][0] * e[i][1]; };
  const double m01 = minor(0, 1);
  const double m12 = minor(1, 2);
  const double m23 = minor(2, 3);
  const double m30 = minor(3, 0);
  const double m02 = minor(0, 2);
  const double m13 = minor(1, 3);
  const double m012 = e[0][2] * m12 - e[1][2] * m02 + e[2][2] * m01;
  const double m123 = e[1][2] * m23 - e[2][2] * m13 + e[3][2] * m12;
  const double m230 = e[2][2] * m30 + e[3][2] * m02 + e[0][2] * m23;
  const double m301 = e[3][2] * m01 + e[0][2] * m13 + e[1][2] * m30;
  return (lift[3] * m012 - lift[2] * m301) + (lift[1] * m230 - lift[0] * m123);
}

template <size_t D>
double LiftedDeterminant(const std::array<std::array<double, D>, D + 1>& e, const std::array<double, D + 1>& lift) {
  std::array<std::array<double, D + 1>, D + 1> rows;
  for (size_t i = 0; i <= D; ++i) {
    std::copy(e[i].begin(), e[i].end(), rows[i].begin());
    rows[i][D] = lift[i];
  }
  return MinorsOf<DoubleRing, D + 1>(rows)[0];
}

}  // namespace

template <int D>
absl::Status Triangulation<D>::Build(const Box<D>& box, HugeVector<Point<D>> points,
                                     std::span<const uint32_t> simplices, const RunContext& context) {
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
                                                     " simplices is too large to be mended or pumped; at most ",
                                                     std::numeric_limits<uint32_t>::max() / (D + 1), " are accepted"));
  }
  const size_t count = simplices.size() / (D + 1);
  items_.reserve(count + count / kRoomToGrow);
  items_.assign(count, {});
  free_.clear();
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
  // Facets by their lowest vertex: those of one vertex are few, and are matched among themselves.
  struct Facet {
    std::array<VertexId, D - 1> others;  // ascending
    uint32_t at;                         // simplex * (D + 1) + slot
  };
  const auto lowest_of = [&](size_t s, int slot) {
    uint32_t lowest = ~uint32_t{0};
    for (int i = 0; i <= D; ++i) {
      lowest = i == slot ? lowest : std::min(lowest, Index(items_[s].vertices[i]));
    }
    return lowest;
  };
  HugeVector<uint32_t> begin(points_.size() + 1, 0);
  for (size_t s = 0; s < count; ++s) {
    if (s % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    for (int slot = 0; slot <= D; ++slot) {
      ++begin[lowest_of(s, slot) + 1];
    }
  }
  for (size_t v = 0; v < points_.size(); ++v) {
    begin[v + 1] += begin[v];
  }
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  HugeVector<uint32_t> at(count * (D + 1));
  HugeVector<uint32_t> next(begin.begin(), begin.end() - 1);
  for (size_t s = 0; s < count; ++s) {
    if (s % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    for (int slot = 0; slot <= D; ++slot) {
      at[next[lowest_of(s, slot)]++] = static_cast<uint32_t>(s * (D + 1)) + static_cast<uint32_t>(slot);
    }
  }
  std::vector<Facet> facets;
  for (uint32_t v = 0; v < points_.size(); ++v) {
    if (v % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    facets.clear();
    for (uint32_t k = begin[v]; k < begin[v + 1]; ++k) {
      const uint32_t s = at[k] / (D + 1);
      const auto slot = static_cast<int>(at[k] % (D + 1));
      Facet facet{{}, at[k]};
      for (int i = 0, to = 0; i <= D; ++i) {
        if (i != slot && Index(items_[s].vertices[i]) != v) {
          facet.others[to++] = items_[s].vertices[i];
        }
      }
      std::sort(facet.others.begin(), facet.others.end());
      facets.push_back(facet);
    }
    std::sort(facets.begin(), facets.end(), [](const Facet& a, const Facet& b) { return a.others < b.others; });
    for (size_t i = 1; i < facets.size(); ++i) {
      if (facets[i].others == facets[i - 1].others) {
        const uint32_t a = facets[i - 1].at;
        const uint32_t b = facets[i].at;
        items_[a / (D + 1)].neighbours[a % (D + 1)] = SimplexId{b / (D + 1)};
        items_[b / (D + 1)].neighbours[b % (D + 1)] = SimplexId{a / (D + 1)};
      }
    }
  }
  return absl::OkStatus();
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
  if (!free_.empty()) {
    const SimplexId s = free_.back();
    free_.pop_back();
    return s;
  }
  items_.emplace_back();
  mark_.push_back(0);
  return SimplexId{static_cast<uint32_t>(items_.size() - 1)};
}

template <int D>
void Triangulation<D>::Free(SimplexId s) {
  items_[Index(s)].vertices[0] = kNoVertex;
  mark_[Index(s)] = 0;
  free_.push_back(s);
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
    for (int i = 0; i <= D; ++i) {
      const SimplexId next = item.neighbours[i];
      if (item.vertices[i] != v && next != kNoSimplex && mark_[Index(next)] != stamp_) {
        mark_[Index(next)] = stamp_;
        out.push_back(next);
      }
    }
  }
}

template <int D>
bool Triangulation<D>::IsInConflict(SimplexId s, const Point<D>& p, double weight) const {
  const std::array<VertexId, D + 1>& vertices = items_[Index(s)].vertices;
  std::array<Point<D>, D + 1> e;
  std::array<double, D + 1> lift;
  double largest = 0;
  for (int i = 0; i <= D; ++i) {
    e[i] = Difference<D>(point(vertices[i]), p);
    lift[i] = NormSq<D>(e[i]) - this->weight(vertices[i]) + weight;
    for (const double x : e[i]) {
      largest = std::max(largest, std::abs(x));
    }
  }
  const double determinant = LiftedDeterminant(e, lift) * (D % 2 == 0 ? 1 : -1);
  double bound = kFilterBound<D>;
  for (int i = 0; i < D + 2; ++i) {
    bound *= largest;
  }
  if (determinant < -bound) {
    return false;
  }
  if (determinant > bound) {
    return true;
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
void Triangulation<D>::FindCavity(SimplexId from, const Point<D>& p, Cavity& out) {
  StartSearch();
  out.simplices.assign(1, from);
  mark_[Index(from)] = stamp_;
  Grow(p, 0, box_.FacesOf(p), out);
}

template <int D>
void Triangulation<D>::FindCavityOfWeight(VertexId v, double weight, Cavity& out) {
  Star(v, out.simplices);
  Grow(point(v), weight, faces(v), out);
}

// Adds what is in conflict to the simplices that are there and marked. Refused ones that touch `p` itself are none.
template <int D>
void Triangulation<D>::Grow(const Point<D>& p, double weight, FaceMask faces, Cavity& out) {
  const uint32_t refused = stamp_ + 1;
  out.boundary.clear();
  for (size_t k = 0; k < out.simplices.size(); ++k) {
    const SimplexId s = out.simplices[k];
    for (int i = 0; i <= D; ++i) {
      const SimplexId next = items_[Index(s)].neighbours[i];
      if (next == kNoSimplex) {
        // Facets on a face of the box that p is on are replaced too.
        if ((FacesOf(items_[Index(s)].vertices, i) & faces) == 0) {
          out.boundary.push_back({s, i});
        }
        continue;
      }
      uint32_t& mark = mark_[Index(next)];
      if (mark == stamp_) {
        continue;
      }
      if (mark != refused) {
        if (IsInConflict(next, p, weight)) {
          mark = stamp_;
          out.simplices.push_back(next);
          continue;
        }
        mark = refused;
      }
      out.boundary.push_back({s, i});
    }
  }
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
    // So that who turns about a ridge inside the cavity comes upon it.
    items_[Index(s)].neighbours[slot] = fresh;
    for (const VertexId u : item.vertices) {
      simplex_of_[Index(u)] = fresh;
    }
  }
  // The neighbour across the facet without vertex j: turn about the ridge of the old facet without j, inside the cavity,
  // until its boundary.
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
  link_.clear();
  open_.clear();
  saved_.clear();
  filling_.clear();
  for (const SimplexId s : star_) {
    const Item& item = items_[Index(s)];
    saved_.push_back({s, item});
    const int slot = item.SlotOf(v);
    Open open{item.vertices, slot, item.neighbours[slot], 0, SumOf(item.vertices, slot)};
    if (open.beyond != kNoSimplex) {
      open.beyond_slot = items_[Index(open.beyond)].SlotOf(s);
    }
    open_.push_back(open);
    for (const VertexId u : item.vertices) {
      if (u != v) {
        link_.push_back(u);
      }
    }
  }
  std::sort(link_.begin(), link_.end());
  link_.erase(std::unique(link_.begin(), link_.end()), link_.end());
  for (const SimplexId s : star_) {
    Free(s);
  }
  simplex_of_[Index(v)] = kNoSimplex;
  removed_ = v;
  while (!open_.empty()) {
    const Open open = open_.back();
    open_.pop_back();
    const SimplexId fresh = Allocate();
    filling_.push_back(fresh);
    Item& item = items_[Index(fresh)];
    item.vertices = open.vertices;
    item.vertices[open.slot] = Wrap(open, fresh);
    item.neighbours.fill(kNoSimplex);
    item.neighbours[open.slot] = open.beyond;
    if (open.beyond != kNoSimplex) {
      items_[Index(open.beyond)].neighbours[open.beyond_slot] = fresh;
    }
    for (const VertexId u : item.vertices) {
      simplex_of_[Index(u)] = fresh;
    }
    for (int slot = 0; slot <= D; ++slot) {
      if (slot != open.slot) {
        LinkFacet(fresh, slot);
      }
    }
  }
  created = filling_;
}

// The neighbour of the removed vertex that is to be joined to a facet of the hole; tried in simplex `fresh`.
template <int D>
VertexId Triangulation<D>::Wrap(const Open& open, SimplexId fresh) {
  VertexId best = kNoVertex;
  for (const VertexId u : link_) {
    const auto* const found = std::find(open.vertices.begin(), open.vertices.end(), u);
    if (found != open.vertices.end() && found - open.vertices.begin() != open.slot) {
      continue;
    }
    if (best != kNoVertex && !IsInConflict(fresh, point(u), weight(u))) {
      continue;
    }
    Simplex<D> corners;
    for (int i = 0; i <= D; ++i) {
      corners[i] = point(i == open.slot ? u : open.vertices[i]);
    }
    if (Orientation<D>(corners).sign == Sign::kPositive) {
      best = u;
      items_[Index(fresh)].vertices = open.vertices;
      items_[Index(fresh)].vertices[open.slot] = u;
    }
  }
  if (best == kNoVertex) {
    std::abort();  // a hole in a box whose corners are vertices has a vertex on the inner side of each facet
  }
  return best;
}

// Joins a facet of a new simplex of the hole to the one that waits for it, or has it wait, unless it is on the box.
template <int D>
void Triangulation<D>::LinkFacet(SimplexId fresh, int slot) {
  Item& item = items_[Index(fresh)];
  const auto is_of_facet = [&](VertexId u) {
    const auto* const found = std::find(item.vertices.begin(), item.vertices.end(), u);
    return found != item.vertices.end() && found - item.vertices.begin() != slot;
  };
  const uint64_t sum = SumOf(item.vertices, slot);
  for (Open& waiting : open_) {
    bool is_same = waiting.sum == sum;
    for (int i = 0; i <= D && is_same; ++i) {
      is_same = i == waiting.slot || is_of_facet(waiting.vertices[i]);
    }
    if (is_same) {
      item.neighbours[slot] = waiting.beyond;
      if (waiting.beyond != kNoSimplex) {
        items_[Index(waiting.beyond)].neighbours[waiting.beyond_slot] = fresh;
      }
      waiting = open_.back();
      open_.pop_back();
      return;
    }
  }
  if (FacesOf(item.vertices, slot) == 0) {
    // Seen from its other side.
    Open next{item.vertices, slot, fresh, slot, sum};
    std::swap(next.vertices[slot == 0 ? 1 : 0], next.vertices[slot <= 1 ? 2 : 1]);
    open_.push_back(next);
  }
}

template <int D>
uint64_t Triangulation<D>::SumOf(const std::array<VertexId, D + 1>& vertices, int opposite) {
  uint64_t sum = 0;
  for (int i = 0; i <= D; ++i) {
    sum += i == opposite ? 0 : Index(vertices[i]);
  }
  return sum;
}

template <int D>
void Triangulation<D>::Restore() {
  // The list of free numbers goes back to what it was, in reverse.
  for (auto it = filling_.rbegin(); it != filling_.rend(); ++it) {
    Free(*it);
  }
  free_.resize(free_.size() - saved_.size());
  for (const auto& [s, item] : saved_) {
    items_[Index(s)] = item;
    const int slot = item.SlotOf(removed_);
    if (item.neighbours[slot] != kNoSimplex) {
      Item& beyond = items_[Index(item.neighbours[slot])];
      for (int i = 0; i <= D; ++i) {
        const VertexId u = beyond.vertices[i];
        if (std::find(item.vertices.begin(), item.vertices.end(), u) == item.vertices.end()) {
          beyond.neighbours[i] = s;
        }
      }
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
