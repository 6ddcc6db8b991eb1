#include "core/sliver/pump.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/simplex/quality.h"
#include "core/sliver/tetrahedron.h"
#include "core/validate/validate.h"

namespace wellspace::core {
namespace {

// All vertices are pumped once; then, as others' weights have changed, again, as long as it helps, but not more often
// than this, those whose star has an angle below this part of a regular simplex's; and as often those with one below
// that part.
template <int D>
constexpr int kRounds = D == 3 ? 12 : 2;
constexpr double kPoorShare = 0.25;
constexpr double kPoorestShare = 0.075;
// Then, in 3-D, so often a group of vertices around each simplex below the second part: one gets these shares of its
// limit.
constexpr int kGroupRounds = 3;
constexpr std::array<double, 5> kGroupShares = {0, 0.25, 0.5, 0.75, 0.999};
// Vertices between two reports of progress.
constexpr uint32_t kReportInterval = 64;

// The larger, the flatter: the cosine of the smallest angle between two facets.
template <int D>
double FlatnessOf(const Simplex<D>& corners) {
  if constexpr (D == 3) {
    return MeasureTetrahedron(corners).cosine;
  } else {
    return -Angles<D>(corners).min_deg;
  }
}

// FlatnessOf for an angle.
template <int D>
double Flatness(double degrees) {
  return D == 3 ? std::cos(degrees * std::numbers::pi / 180) : -degrees;
}

// The weight from which on a vertex at `p` is in conflict with the simplex; infinite if it cannot be told.
//
// With e_i = p_i - p, the plane through the lifted corners (e_i, |e_i|^2 - W_i) has the height -W at p: D + 1 linear
// equations for its slopes and height, by elimination with pivots. Rounding moves the event, and nothing is decided by
// that: the star is found anew for the weight that is chosen.
template <int D>
double CriticalWeight(const Triangulation<D>& triangulation, SimplexId s, const Point<D>& p) {
  std::array<std::array<double, D + 2>, D + 1> rows;
  for (int i = 0; i <= D; ++i) {
    const VertexId u = triangulation.item(s).vertices[i];
    const Point<D> e = Difference<D>(triangulation.point(u), p);
    std::copy(e.begin(), e.end(), rows[i].begin());
    rows[i][D] = 1;
    rows[i][D + 1] = NormSq<D>(e) - triangulation.weight(u);
  }
  for (int k = 0; k <= D; ++k) {
    int pivot = k;
    for (int i = k + 1; i <= D; ++i) {
      pivot = std::abs(rows[i][k]) > std::abs(rows[pivot][k]) ? i : pivot;
    }
    std::swap(rows[k], rows[pivot]);
    if (rows[k][k] == 0) {
      return std::numeric_limits<double>::infinity();
    }
    for (int i = k + 1; i <= D; ++i) {
      const double factor = rows[i][k] / rows[k][k];
      for (int j = k + 1; j <= D + 1; ++j) {
        rows[i][j] -= factor * rows[k][j];
      }
    }
  }
  return -rows[D][D + 1] / rows[D][D];
}

// Weighs one vertex at a time: as the weight rises, the star grows by one simplex beyond its boundary after the other.
template <int D>
class Pump {
 public:
  explicit Pump(Triangulation<D>& triangulation) : triangulation_(triangulation) {}

  // Gives `v` the best weight in [0, limit], if its star has a simplex flatter than `poor`. Returns whether it is
  // another than before. A corner of the box keeps the first weight that it has got.
  bool SetBest(VertexId v, double limit, double poor) {
    const double old = triangulation_.weight(v);
    if (old > 0 && IsCorner(v)) {
      return false;
    }
    const double before = FlattestOfStar(v);
    if (!(before > poor)) {
      return false;
    }
    TakeWeight(v);
    Raise(v, limit);
    if (triangulation_.weight(v) != old && !(FlattestOfStar(v) < before)) {
      SetWeight(v, old);
    }
    return triangulation_.weight(v) != old;
  }

  // The vertices of a simplex, ascending.
  using Vertices = std::array<VertexId, D + 1>;

  // The simplices flatter than `poor`, in an order that does not depend on how they are numbered.
  std::vector<Vertices> FindPoor(double poor) const {
    std::vector<Vertices> found;
    for (uint32_t i = 0; i < triangulation_.simplex_limit(); ++i) {
      if (triangulation_.IsIn(SimplexId{i}) && IsPoor(SimplexId{i}, poor)) {
        found.push_back(VerticesOf(SimplexId{i}));
      }
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  // Has fewer simplices flatter than `poor` around one that is, unless it has gone: a vertex near it gets another
  // weight, and those around the best then. `limit_of`(VertexId) is the limit of a weight.
  template <typename LimitOf>
  void SetBestOfGroup(const Vertices& flat, LimitOf limit_of, double poor) {
    triangulation_.Star(flat[0], star_);
    if (std::none_of(star_.begin(), star_.end(), [&](SimplexId s) { return VerticesOf(s) == flat; })) {
      return;
    }
    for (const VertexId v : flat) {
      if (IsCorner(v)) {
        continue;
      }
      std::vector<VertexId> around;
      ListAround(v, around);
      for (const VertexId u : around) {
        if (u != v && !IsCorner(u) && SetBestAround(u, v, limit_of, poor)) {
          return;
        }
      }
    }
  }

 private:
  Vertices VerticesOf(SimplexId s) const {
    Vertices vertices = triangulation_.item(s).vertices;
    std::sort(vertices.begin(), vertices.end());
    return vertices;
  }
  bool IsPoor(SimplexId s, double poor) const { return FlatnessOf<D>(triangulation_.Corners(s)) > poor; }
  // Whether `v` is a corner of the box.
  bool IsCorner(VertexId v) const { return std::popcount(triangulation_.faces(v)) == D; }

  // Gives `u` one weight after the other, and those around it and `v` that have a poor star then the best, until it
  // helps. Whether it has; nothing has changed if not.
  template <typename LimitOf>
  bool SetBestAround(VertexId u, VertexId v, LimitOf limit_of, double poor) {
    near_.clear();
    ListAround(u, near_);
    ListAround(v, near_);
    far_.clear();
    old_.clear();
    for (const VertexId w : near_) {
      ListAround(w, far_);
      old_.push_back(triangulation_.weight(w));
    }
    const Poverty before = PovertyAround(far_, poor);
    const double old_u = triangulation_.weight(u);
    for (const double share : kGroupShares) {
      const double weight = static_cast<float>(share * limit_of(u));
      if (weight == old_u) {
        continue;
      }
      SetWeight(u, weight);
      for (const VertexId w : near_) {
        if (w != u && !IsCorner(w)) {
          SetBest(w, limit_of(w), poor);
        }
      }
      const Poverty after = PovertyAround(far_, poor);
      if (after.simplices < before.simplices && after.flattest <= before.flattest && !(FlattestOfStar(v) > poor)) {
        return true;
      }
      for (size_t i = 0; i < near_.size(); ++i) {
        if (triangulation_.weight(near_[i]) != old_[i]) {
          SetWeight(near_[i], old_[i]);
        }
      }
    }
    return false;
  }

  double FlattestOfStar(VertexId v) {
    triangulation_.Star(v, star_);
    double flattest = -std::numeric_limits<double>::infinity();
    for (const SimplexId s : star_) {
      flattest = std::max(flattest, FlatnessOf<D>(triangulation_.Corners(s)));
    }
    return flattest;
  }

  // Lists the vertices that share simplices with `v`, and v, beside those of `out`.
  void ListAround(VertexId v, std::vector<VertexId>& out) {
    triangulation_.Star(v, star_);
    for (const SimplexId s : star_) {
      out.insert(out.end(), triangulation_.item(s).vertices.begin(), triangulation_.item(s).vertices.end());
    }
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
  }

  // Simplices flatter than a bound.
  struct Poverty {
    uint64_t simplices = 0;  // each counted once for each of the vertices that are looked at
    double flattest = -std::numeric_limits<double>::infinity();
  };
  Poverty PovertyAround(std::span<const VertexId> vertices, double poor) {
    Poverty poverty;
    for (const VertexId v : vertices) {
      const double flattest = FlattestOfStar(v);
      poverty.flattest = std::max(poverty.flattest, flattest);
      if (flattest > poor) {
        poverty.simplices += std::count_if(star_.begin(), star_.end(), [&](SimplexId s) { return IsPoor(s, poor); });
      }
    }
    return poverty;
  }

  // Gives `v` a weight that keeps all vertices in.
  void SetWeight(VertexId v, double weight) {
    TakeWeight(v);
    if (weight > 0) {
      triangulation_.FindCavityOfWeight(v, weight, cavity_);
      triangulation_.Insert(v, triangulation_.point(v), weight, cavity_, created_);
    }
  }

  // Puts `v` back with a weight of zero.
  void TakeWeight(VertexId v) {
    if (triangulation_.weight(v) == 0) {
      return;
    }
    const Point<D> p = triangulation_.point(v);
    triangulation_.Remove(v, created_);
    // The hole holds p.
    SimplexId from = kNoSimplex;
    for (size_t k = 0; from == kNoSimplex; ++k) {
      from = triangulation_.IsInConflict(created_.at(k), p) ? created_[k] : kNoSimplex;
    }
    triangulation_.FindCavity(from, p, cavity_);
    triangulation_.Insert(v, p, 0, cavity_, created_);
  }

  // Looks for a better weight of `v`, which has none, of at most `limit`.
  void Raise(VertexId v, double limit) {
    const Point<D> p = triangulation_.point(v);
    // The star as it is: no simplex beyond it is in conflict with v.
    triangulation_.FindCavityOfWeight(v, 0, cavity_);
    facets_.clear();
    events_.clear();
    region_.assign(cavity_.simplices.begin(), cavity_.simplices.end());
    for (const Cavity::Facet& facet : cavity_.boundary) {
      AddFacet(facet, p, limit);
    }
    const double before = Flattest();
    double best = before;
    double chosen = 0;
    double reached = 0;
    while (true) {
      // The star does not change until the next event.
      double until = limit;
      if (!events_.empty()) {
        std::pop_heap(events_.begin(), events_.end(), IsLater);
        until = std::min(limit, events_.back().weight);
      }
      const auto weight = static_cast<double>(static_cast<float>(0.5 * (reached + until)));
      if (weight > reached && weight < until && Flattest() < best) {
        best = Flattest();
        chosen = weight;
      }
      if (events_.empty()) {
        break;
      }
      const SimplexId next = events_.back().simplex;
      reached = std::max(reached, until);
      events_.pop_back();
      if (std::find(region_.begin(), region_.end(), next) == region_.end()) {
        Take(next, v, p, limit);
      }
    }
    if (chosen == 0) {
      return;
    }
    // Rounding of the events decides nothing: the star under the weight is found exactly.
    triangulation_.FindCavityOfWeight(v, chosen, cavity_);
    double exact = -std::numeric_limits<double>::infinity();
    for (const auto& [s, slot] : cavity_.boundary) {
      exact = std::max(exact, FlatnessWith(s, slot, p));
    }
    if (exact < before) {
      triangulation_.Insert(v, p, chosen, cavity_, created_);
    }
  }

  struct Event {
    double weight;
    SimplexId simplex;
  };
  static bool IsLater(const Event& a, const Event& b) {
    return a.weight != b.weight ? a.weight > b.weight : Index(a.simplex) > Index(b.simplex);
  }
  struct Facet {
    Cavity::Facet at;
    double flatness;  // of its simplex with v
  };

  double FlatnessWith(SimplexId s, int slot, const Point<D>& p) const {
    Simplex<D> corners = triangulation_.Corners(s);
    corners[slot] = p;
    return FlatnessOf<D>(corners);
  }

  double Flattest() const {
    double flattest = -std::numeric_limits<double>::infinity();
    for (const Facet& facet : facets_) {
      flattest = std::max(flattest, facet.flatness);
    }
    return flattest;
  }

  void AddFacet(const Cavity::Facet& facet, const Point<D>& p, double limit) {
    facets_.push_back({facet, FlatnessWith(facet.simplex, facet.slot, p)});
    const SimplexId beyond = triangulation_.item(facet.simplex).neighbours[facet.slot];
    if (beyond != kNoSimplex) {
      const double weight = CriticalWeight<D>(triangulation_, beyond, p);
      if (weight < limit) {
        events_.push_back({weight, beyond});
        std::push_heap(events_.begin(), events_.end(), IsLater);
      }
    }
  }

  // The star swallows simplex `s`.
  void Take(SimplexId s, VertexId v, const Point<D>& p, double limit) {
    region_.push_back(s);
    std::erase_if(facets_, [&](const Facet& facet) {
      return triangulation_.item(facet.at.simplex).neighbours[facet.at.slot] == s;
    });
    const auto& item = triangulation_.item(s);
    for (int i = 0; i <= D; ++i) {
      const SimplexId beyond = item.neighbours[i];
      const bool is_inside = beyond == kNoSimplex ? (triangulation_.FacesOf(s, i) & triangulation_.faces(v)) != 0
                                                  : std::find(region_.begin(), region_.end(), beyond) != region_.end();
      if (!is_inside) {
        AddFacet({s, i}, p, limit);
      }
    }
  }

  Triangulation<D>& triangulation_;
  Cavity cavity_;
  std::vector<SimplexId> region_;
  std::vector<Facet> facets_;
  std::vector<Event> events_;  // a heap, the lowest weight on top
  std::vector<SimplexId> created_;
  std::vector<SimplexId> star_;
  std::vector<VertexId> near_;
  std::vector<VertexId> far_;  // those around them
  std::vector<double> old_;    // weights of those near
};

}  // namespace

template <int D>
absl::StatusOr<uint64_t> PumpWeights(Triangulation<D>& triangulation, RunContext& context) {
  const uint32_t count = triangulation.vertex_count();
  WELLSPACE_ASSIGN_OR_RETURN(const HugeVector<double> nearest_sq, triangulation.NearestDistancesSq(context));
  Pump<D> pump(triangulation);
  for (int round = 0; round < 2 * kRounds<D>; ++round) {
    const double share = round < kRounds<D> ? kPoorShare : kPoorestShare;
    const double poor =
        round == 0 ? -std::numeric_limits<double>::infinity() : Flatness<D>(share * LargestSmallestAngle(D));
    uint64_t changed = 0;
    for (uint32_t v = 0; v < count; ++v) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      changed += pump.SetBest(VertexId{v}, kMostWeight * nearest_sq[v], poor) ? 1 : 0;
      if (v % kReportInterval == 0) {
        context.SetPhaseFraction((round + static_cast<double>(v) / count) / (2 * kRounds<D>));
      }
    }
    if (changed == 0) {
      break;
    }
  }
  if constexpr (D == 3) {
    const double poor = Flatness<D>(kPoorestShare * LargestSmallestAngle(D));
    const auto limit_of = [&](VertexId v) { return kMostWeight * nearest_sq[Index(v)]; };
    for (int round = 0; round < kGroupRounds; ++round) {
      for (const auto& flat : pump.FindPoor(poor)) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
        pump.SetBestOfGroup(flat, limit_of, poor);
      }
    }
  }
  uint64_t weighted = 0;
  for (uint32_t v = 0; v < count; ++v) {
    weighted += triangulation.weight(VertexId{v}) > 0 ? 1 : 0;
  }
  return weighted;
}

template absl::StatusOr<uint64_t> PumpWeights<3>(Triangulation<3>&, RunContext&);
template absl::StatusOr<uint64_t> PumpWeights<4>(Triangulation<4>&, RunContext&);
template absl::StatusOr<uint64_t> PumpWeights<5>(Triangulation<5>&, RunContext&);
template absl::StatusOr<uint64_t> PumpWeights<6>(Triangulation<6>&, RunContext&);

}  // namespace wellspace::core
