#include "core/sliver/repair.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/simplex/quality.h"
#include "core/sliver/surface_carrier.h"

namespace wellspace::core {
namespace {

// Where a place may have any angles.
constexpr double kNoLimit = std::numeric_limits<double>::infinity();
// In the place of a cosine: at or above every limit.
constexpr double kNotAdmissible = std::numeric_limits<double>::infinity();

// Sections are those of docs/design/sliver.md that explain a constant, and have its measurements.

// A vertex moves by at most this times the distance to its nearest neighbour. "Repair", step 1: 94 of 100 moves
// succeed with it.
constexpr double kReach = 0.4;
// A new vertex lies in the sliver's circumball shrunk by this. "Repair", step 3; other values have not been measured.
constexpr double kInside = 0.95;
// Places that are tried for a vertex; where few slivers are left after some passes, more: so many for all of them.
constexpr int kSamples = 24;
constexpr int kMostSamples = 1536;
constexpr int kLateSamples = 4096;
// Facets that are kept because places failed by them.
constexpr size_t kSuspects = 4;
// Slivers are looked at again in so many passes at most, and in each at most so many times as many as it began with:
// every step makes the flattest it touches better, but nothing says by how much in all.
constexpr int kPasses = 40;
constexpr int kEarlyPasses = 4;
constexpr size_t kGrowth = 8;
constexpr size_t kLeastGrowth = 1000;
// The most vertices whose changed stars are told of at once, so that those that change again and again are told of
// seldom.
constexpr size_t kMostChanged = 1 << 16;
// A vertex of more simplices is not moved: taking it out costs their square, and a place good for all hardly exists.
constexpr size_t kMostStar = 128;
// Where that many slivers are left by a pass, and few are gone, the next passes are those that may add poor vertices.
// "Repair", "Work is bounded": a torus at rho = 10 took more than a minute without, and 4 s with them.
constexpr size_t kMany = 1000;
constexpr double kFewGone = 0.125;
// A step that leaves a sliver has to make 1 - cosine, nearly half the angle squared, larger by this. "Repair": it keeps
// steps from being many; other values have not been measured.
constexpr double kGain = 1.1;

bool IsBetter(double cosine, double than) { return 1 - cosine >= kGain * (1 - than); }

}  // namespace

template <VertexCarrier Carrier>
Repairer<Carrier>::Repairer(Triangulation<3>& triangulation, Carrier& carrier, std::vector<bool>& is_fixed,
                            const RepairCriteria& criteria, KnownCosines& cosines, RepairObserver& observer)
    : triangulation_(triangulation),
      carrier_(carrier),
      is_fixed_(is_fixed),
      criteria_(criteria),
      cosines_(cosines),
      observer_(observer),
      flat_cosine_(FlatCosine(criteria.min_dihedral)) {}

template <VertexCarrier Carrier>
absl::Status Repairer<Carrier>::Run(int threads, RunContext& context) {
  try {
    const absl::Status status = RunPasses(threads, context);
    ReportStars();
    return status;
  } catch (...) {  // no memory
    ReportStars();
    throw;
  }
}

// The effort of pass `pass`, where `left` slivers are left to it:
//   0         move the vertices of a sliver
//   1         and those beyond its facets
//   2 and 3   and add a vertex whose star is good
//   4         the same, with more places the fewer slivers are left
//   5 on      and add a vertex that has slivers, though better ones
template <VertexCarrier Carrier>
auto Repairer<Carrier>::EffortOf(int pass, size_t left) -> Effort {
  Effort effort;
  effort.samples =
      pass < kEarlyPasses
          ? kSamples
          : std::clamp(kLateSamples / static_cast<int>(std::min<size_t>(left, kLateSamples)), kSamples, kMostSamples);
  effort.may_move_neighbours = pass >= 1;
  effort.may_insert = pass >= 2;
  effort.may_insert_poor = pass > kEarlyPasses;
  return effort;
}

template <VertexCarrier Carrier>
absl::Status Repairer<Carrier>::RunPasses(int threads, RunContext& context) {
  context_ = &context;
  if (criteria_.criteria.criterion == Criterion::kWellSpaced) {
    WELLSPACE_ASSIGN_OR_RETURN(nearest_sq_, triangulation_.NearestDistancesSq(context));
  }
  WELLSPACE_RETURN_IF_ERROR(FindSlivers(threads, context));
  report_.slivers += next_.size();
  report_.slivers_left = next_.size();
  int ahead = 0;  // passes that were skipped
  for (int at = 0; at < kPasses && !next_.empty() && HasWork(); ++at) {
    const int pass = at + ahead;
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(observer_.MemoryBytes() + carrier_.MemoryBytes() +
                                                  triangulation_.MemoryBytes() + cosines_.MemoryBytes() +
                                                  next_.size() * sizeof(Sliver)));
    const Effort effort = EffortOf(pass, next_.size());
    const size_t begun = next_.size();
    const size_t limit = kGrowth * begun + kLeastGrowth;
    std::vector<Sliver> left;
    for (size_t k = 0; k < next_.size(); ++k) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      const Sliver sliver = next_[k];
      const bool is_tried = k < limit && HasWork();
      if (IsThere(sliver) && (!is_tried || !MoveVertices(sliver, effort))) {
        if (is_tried && effort.may_insert) {
          WELLSPACE_RETURN_IF_ERROR(Insert(sliver, effort));
          context.SetVertices(triangulation_.vertex_count());
        }
        left.push_back(sliver);
      }
      if (changed_.size() > kMostChanged) {
        ReportStars();
      }
      context.SetPhaseFraction(1 - static_cast<double>(left.size() + next_.size() - k) /
                                       static_cast<double>(report_.slivers + next_.size()));
    }
    next_.clear();
    std::copy_if(left.begin(), left.end(), std::back_inserter(next_), [this](const Sliver& s) { return IsThere(s); });
    report_.slivers_left = next_.size();
    if (effort.may_insert && pass <= kEarlyPasses && next_.size() >= kMany &&
        static_cast<double>(next_.size()) > (1 - kFewGone) * static_cast<double>(begun)) {
      ahead = kEarlyPasses - at;
    }
  }
  ExplainLeft();
  std::vector<SimplexId> slivers;
  for (const Sliver& sliver : next_) {
    slivers.push_back(sliver.simplex);
  }
  cosines_.EndRun(slivers);
  return absl::OkStatus();
}

// Says why slivers are left, and names the flattest.
template <VertexCarrier Carrier>
void Repairer<Carrier>::ExplainLeft() {
  const bool has_work = HasWork();
  std::vector<std::pair<Sliver, SliverReason>> left;
  for (const Sliver& sliver : next_) {
    left.emplace_back(sliver, has_work ? ReasonOf(sliver) : SliverReason::kWork);
    ++report_.left_by[static_cast<size_t>(left.back().second)];
  }
  std::sort(left.begin(), left.end(), [this](const auto& a, const auto& b) {
    const double cosine_a = CosineOf(a.first.simplex);
    const double cosine_b = CosineOf(b.first.simplex);
    return cosine_a != cosine_b ? cosine_a > cosine_b : a.first.vertices < b.first.vertices;
  });
  left.resize(std::min(left.size(), kMostNamedSlivers));
  for (const auto& [sliver, reason] : left) {
    LeftSliver& named = report_.flattest_left.emplace_back();
    std::transform(sliver.vertices.begin(), sliver.vertices.end(), named.vertices.begin(),
                   [](VertexId v) { return Index(v); });
    named.min_angle_deg = Angles<3>(triangulation_.Corners(sliver.simplex)).min_deg;
    named.reason = reason;
  }
}

// Whether a place in the sliver's circumball keeps the criteria, whatever the angles there.
template <VertexCarrier Carrier>
SliverReason Repairer<Carrier>::ReasonOf(const Sliver& sliver) {
  const TetrahedronMeasure measure = MeasureFlatTetrahedron(triangulation_.Corners(sliver.simplex));
  const VertexId v{triangulation_.vertex_count()};
  suspects_.clear();
  hole_.clear();
  for (int k = 0; k < kSamples; ++k) {
    const Point<3> p = DrawInBall(measure, k == 0);
    if (carrier_.MayHold(triangulation_, p) && triangulation_.IsInConflict(sliver.simplex, p) &&
        TryAt(sliver.simplex, p, v, kNoLimit).has_value() && Accepts(v, p)) {
      return SliverReason::kAngle;
    }
  }
  return SliverReason::kDemands;
}

// A place in the shrunk circumball, or its centre.
template <VertexCarrier Carrier>
Point<3> Repairer<Carrier>::DrawInBall(const TetrahedronMeasure& measure, bool is_centre) {
  const double radius = kInside * std::sqrt(measure.radius_sq);
  Point<3> p = is_centre ? Point<3>{} : draws_.Next();
  for (int i = 0; i < 3; ++i) {
    p[i] = measure.centre[i] + radius * p[i];
  }
  return p;
}

// Lists the slivers among all simplices.
template <VertexCarrier Carrier>
absl::Status Repairer<Carrier>::FindSlivers(int threads, const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(
      const std::vector<SimplexId> slivers,
      cosines_.BeginRun(triangulation_, carrier_, flat_cosine_, threads, context, report_.measured));
  NoteSmallestAngle();
  next_.clear();
  for (const SimplexId s : slivers) {
    next_.push_back({s, triangulation_.item(s).vertices});
  }
  return absl::OkStatus();
}

template <VertexCarrier Carrier>
bool Repairer<Carrier>::IsThere(const Sliver& sliver) const {
  return triangulation_.IsIn(sliver.simplex) && triangulation_.item(sliver.simplex).vertices == sliver.vertices &&
         CosineOf(sliver.simplex) > flat_cosine_;
}

// The cosine of a tetrahedron that a step would make; none if it is not below `limit`, or the criteria do not allow for
// the tetrahedron. `moved` as for IsAdmissible.
template <VertexCarrier Carrier>
std::optional<double> Repairer<Carrier>::Judge(const Simplex<3>& corners, const std::array<VertexId, 4>& vertices,
                                               VertexId moved, double limit) const {
  const TetrahedronMeasure measure = MeasureTetrahedron(corners);
  if constexpr (!Carrier::kMeshesAll) {
    if (!carrier_.IsMeshed(corners)) {
      return HasShape(measure, carrier_.OutsideRho(corners)) ? std::optional(kUncountedCosine) : std::nullopt;
    }
  }
  return measure.cosine < limit && IsAdmissible(measure, vertices, moved) ? std::optional(measure.cosine)
                                                                          : std::nullopt;
}

// Whether a tetrahedron has at most that radius-edge ratio, edges that are long enough, and its centre in the box.
template <VertexCarrier Carrier>
bool Repairer<Carrier>::HasShape(const TetrahedronMeasure& measure, double rho) const {
  // Comparisons with NaN fail.
  return measure.determinant > 0 && measure.radius_sq <= rho * rho * measure.edge_sq &&
         measure.edge_sq >= criteria_.min_edge * criteria_.min_edge && triangulation_.box().Contains(measure.centre);
}

// Whether the criteria allow for a tetrahedron, of which `moved` is the vertex whose nearest neighbour is as far
// as edge_limit_sq_ says.
template <VertexCarrier Carrier>
bool Repairer<Carrier>::IsAdmissible(const TetrahedronMeasure& measure, const std::array<VertexId, 4>& vertices,
                                     VertexId moved) const {
  const MeshCriteria<3>& criteria = criteria_.criteria;
  const double rho_sq = criteria.rho * criteria.rho;
  if (!HasShape(measure, criteria.rho)) {
    return false;
  }
  if (criteria.criterion == Criterion::kWellSpaced) {
    for (const VertexId u : vertices) {
      if (!(measure.radius_sq <= rho_sq * (u == moved ? edge_limit_sq_ : nearest_sq_[Index(u)]))) {
        return false;
      }
    }
  }
  return criteria.sizes.IsUnbounded() || measure.radius_sq <= criteria.sizes.AtSq(measure.centre, measure.radius_sq);
}

// The squared distance of a vertex at `p`, which would replace the cavity, to its nearest neighbour; none if it would
// become the nearest neighbour of another vertex.
template <VertexCarrier Carrier>
std::optional<double> Repairer<Carrier>::NewNearestSq(const Point<3>& p, VertexId moved) const {
  double new_nearest_sq = std::numeric_limits<double>::infinity();
  for (const auto& [s, slot] : cavity_.boundary) {
    const auto& vertices = triangulation_.item(s).vertices;
    for (int i = 0; i < 4; ++i) {
      if (i != slot && vertices[i] != moved) {
        const double distance_sq = DistanceSq<3>(triangulation_.point(vertices[i]), p);
        if (distance_sq < nearest_sq_[Index(vertices[i])]) {
          return std::nullopt;
        }
        new_nearest_sq = std::min(new_nearest_sq, distance_sq);
      }
    }
  }
  return new_nearest_sq;
}

// The largest cosine of the tetrahedron that vertex `v` at `p` makes with a facet; none if it is not below `limit`, or
// the criteria do not allow for it.
template <VertexCarrier Carrier>
std::optional<double> Repairer<Carrier>::TryFacet(const Cavity::Facet& facet, const Point<3>& p, VertexId v,
                                                  double limit) const {
  std::array<VertexId, 4> vertices = triangulation_.item(facet.simplex).vertices;
  Simplex<3> corners = triangulation_.Corners(facet.simplex);
  vertices[facet.slot] = v;
  corners[facet.slot] = p;
  return Judge(corners, vertices, v, limit);
}

// The largest cosine in the star of vertex `v` at `p`, which is in conflict with `from`; none if one is not below
// `limit`, or the criteria do not allow for it. Else the cavity has been found.
template <VertexCarrier Carrier>
std::optional<double> Repairer<Carrier>::TryAt(SimplexId from, const Point<3>& p, VertexId v, double limit) {
  edge_limit_sq_ = std::numeric_limits<double>::infinity();
  if (FailsAtSuspect(p, v, limit)) {
    return std::nullopt;
  }
  double worst = -1;
  const bool is_allowed = triangulation_.FindCavityUnless(from, p, cavity_, [&](const Cavity::Facet& facet) {
    const std::optional<double> cosine = TryFacet(facet, p, v, limit);
    worst = std::max(worst, cosine.value_or(worst));
    return !cosine.has_value();
  });
  report_.operations += cavity_.simplices.size() + cavity_.boundary.size();
  if (!is_allowed) {
    if (suspects_.size() == kSuspects) {
      suspects_.pop_back();
    }
    suspects_.insert(suspects_.begin(), cavity_.boundary.back());
    return std::nullopt;
  }
  if (criteria_.criteria.criterion == Criterion::kWellSpaced) {
    const std::optional<double> new_nearest_sq = NewNearestSq(p, v);
    if (!new_nearest_sq.has_value()) {
      return std::nullopt;
    }
    edge_limit_sq_ = *new_nearest_sq;
    if (!std::all_of(cavity_.boundary.begin(), cavity_.boundary.end(),
                     [&](const Cavity::Facet& facet) { return TryFacet(facet, p, v, limit).has_value(); })) {
      return std::nullopt;
    }
  }
  return worst;
}

// Whether the boundary of the cavity of `p` surely has a facet for which TryAt returns none: one for which it did
// lately.
template <VertexCarrier Carrier>
bool Repairer<Carrier>::FailsAtSuspect(const Point<3>& p, VertexId v, double limit) {
  for (auto facet = suspects_.begin(); facet != suspects_.end(); ++facet) {
    const SimplexId beyond = triangulation_.item(facet->simplex).neighbours[facet->slot];
    if (beyond != kNoSimplex && triangulation_.IsInConflict(facet->simplex, p) &&
        !triangulation_.IsInConflict(beyond, p) && !TryFacet(*facet, p, v, limit).has_value()) {
      std::rotate(suspects_.begin(), facet, facet + 1);
      return true;
    }
  }
  return false;
}

// Measures new tetrahedra; slivers among them will be looked at.
template <VertexCarrier Carrier>
void Repairer<Carrier>::Note(std::span<const SimplexId> created) {
  cosines_.GrowTo(triangulation_.simplex_limit());
  is_changed_.resize(triangulation_.vertex_count());
  for (const SimplexId s : created) {
    const auto& vertices = triangulation_.item(s).vertices;
    for (const VertexId v : vertices) {
      if (!is_changed_[Index(v)]) {
        is_changed_[Index(v)] = true;
        changed_.push_back(v);
      }
    }
    cosines_.Set(s, CountedCosine(carrier_, triangulation_.Corners(s)));
    if (CosineOf(s) > flat_cosine_) {
      next_.push_back({s, vertices});
    }
  }
}

// Tells whose stars have changed since the last time.
template <VertexCarrier Carrier>
void Repairer<Carrier>::ReportStars() {
  for (const VertexId v : changed_) {
    is_changed_[Index(v)] = false;
    observer_.StarChanged(v);
  }
  changed_.clear();
}

// Moves vertices of the sliver, or next to it. Returns whether the sliver has gone.
template <VertexCarrier Carrier>
bool Repairer<Carrier>::MoveVertices(const Sliver& sliver, const Effort& effort) {
  for (const VertexId v : sliver.vertices) {
    if (MayMove(v) && Move(v, sliver, effort.samples)) {
      return true;
    }
  }
  for (int i = 0; i < 4 && effort.may_move_neighbours; ++i) {
    const SimplexId beyond = triangulation_.item(sliver.simplex).neighbours[i];
    if (beyond != kNoSimplex) {
      const auto& item = triangulation_.item(beyond);
      const VertexId v = item.vertices[item.SlotOf(sliver.simplex)];
      if (MayMove(v) && Move(v, sliver, effort.samples)) {
        return true;
      }
    }
  }
  return false;
}

// How `v` may move to do away with the sliver: nearby or, if it is no vertex of the sliver, on the way to the sliver's
// circumcentre. None if v has too many simplices.
template <VertexCarrier Carrier>
auto Repairer<Carrier>::StartOf(VertexId v, const Sliver& sliver) -> std::optional<Mover> {
  triangulation_.Star(v, star_);
  report_.operations += star_.size();
  if (star_.size() > kMostStar) {
    return std::nullopt;
  }
  Mover mover;
  mover.star_size = star_.size();
  mover.from = triangulation_.point(v);
  mover.track = carrier_.TrackOf(triangulation_, v);
  mover.flattest = CosineOf(sliver.simplex);
  double edge_sq = kNoLimit;
  for (const SimplexId s : star_) {
    mover.flattest = std::max(mover.flattest, CosineOf(s));
    for (const VertexId u : triangulation_.item(s).vertices) {
      if (u != v) {
        edge_sq = std::min(edge_sq, DistanceSq<3>(mover.from, triangulation_.point(u)));
      }
    }
  }
  mover.reach = kReach * std::sqrt(edge_sq);
  mover.is_own = std::find(sliver.vertices.begin(), sliver.vertices.end(), v) != sliver.vertices.end();
  if (!mover.is_own) {
    mover.way = Difference<3>(MeasureFlatTetrahedron(triangulation_.Corners(sliver.simplex)).centre, mover.from);
  }
  return mover;
}

// Takes `v` out, which has so many simplices, and measures the filling of the hole.
template <VertexCarrier Carrier>
void Repairer<Carrier>::OpenHole(VertexId v, size_t star_size) {
  triangulation_.Remove(v, hole_);
  report_.operations += star_size * star_size;  // each facet of the hole is held to each neighbour
  hole_cosine_.clear();
  for (const SimplexId s : hole_) {
    hole_cosine_.push_back(
        Judge(triangulation_.Corners(s), triangulation_.item(s).vertices, v, kNoLimit).value_or(kNotAdmissible));
  }
}

// The next place that is tried for a vertex, if that leads to one.
template <VertexCarrier Carrier>
std::optional<Point<3>> Repairer<Carrier>::DrawPlaceFor(const Mover& mover) {
  Point<3> p = draws_.Next();
  const double share = mover.is_own ? 0 : 0.5 * (1 + draws_.Next()[0]);
  for (int i = 0; i < 3; ++i) {
    p[i] = mover.from[i] + mover.reach * p[i] + share * mover.way[i];
  }
  return carrier_.Bring(triangulation_, mover.track, p);
}

// The simplex of the filling that is in conflict with `p`, if there is one.
template <VertexCarrier Carrier>
std::vector<SimplexId>::const_iterator Repairer<Carrier>::FirstInHole(const Point<3>& p) const {
  return std::find_if(hole_.begin(), hole_.end(), [&](SimplexId s) { return triangulation_.IsInConflict(s, p); });
}

// The largest cosine of the simplices that `v` at `p` makes, and of the rest of the filling; none if not below `limit`,
// or the criteria do not allow for it.
template <VertexCarrier Carrier>
std::optional<double> Repairer<Carrier>::TryInHole(VertexId v, const Point<3>& p, double limit) {
  for (size_t i = 0; i < hole_.size(); ++i) {
    if (hole_cosine_[i] >= limit && !triangulation_.IsInConflict(hole_[i], p)) {
      return std::nullopt;
    }
  }
  const auto first = FirstInHole(p);
  if (first == hole_.end()) {
    return std::nullopt;
  }
  std::optional<double> worst = TryAt(*first, p, v, limit);
  for (size_t i = 0; worst.has_value() && i < hole_.size(); ++i) {
    worst = triangulation_.IsInCavity(hole_[i]) ? *worst : std::max(*worst, hole_cosine_[i]);
  }
  return worst;
}

// Looks for a better place of `v`, such that the sliver goes and all new simplices are better than the flattest that
// the move destroys. Returns whether it has moved.
template <VertexCarrier Carrier>
bool Repairer<Carrier>::Move(VertexId v, const Sliver& sliver, int samples) {
  const std::optional<Mover> mover = StartOf(v, sliver);
  if (!mover.has_value()) {
    return false;
  }
  OpenHole(v, mover->star_size);
  suspects_.clear();
  double best = mover->flattest;
  Point<3> to = mover->from;
  for (int k = 0; k < samples && best > flat_cosine_ && MayTry(k); ++k) {
    report_.operations += hole_.size();
    const std::optional<Point<3>> p = DrawPlaceFor(*mover);
    if (!p.has_value() || (!mover->is_own && !triangulation_.IsInConflict(sliver.simplex, *p))) {
      continue;
    }
    const std::optional<double> worst = TryInHole(v, *p, best);
    if (worst.has_value() && *worst < best && (*worst <= flat_cosine_ || IsBetter(*worst, mover->flattest)) &&
        Accepts(v, *p)) {
      best = *worst;
      to = *p;
    }
  }
  if (best == mover->flattest) {
    triangulation_.Restore();
    return false;
  }
  triangulation_.FindCavity(*FirstInHole(to), to, cavity_);
  if (!nearest_sq_.empty()) {
    nearest_sq_[Index(v)] = NewNearestSq(to, v).value();  // TryAt has found that there is one
  }
  std::erase_if(hole_, [this](SimplexId s) { return triangulation_.IsInCavity(s); });
  triangulation_.Insert(v, to, 0, cavity_, created_);
  ++report_.moves;
  Note(hole_);
  Note(created_);
  carrier_.Moved(triangulation_, v, NeighbourIn(created_.front(), v));
  observer_.VertexMoved(v);
  return true;
}

// Adds a vertex in the sliver's circumball: of the places whose star is good, the one that removes most slivers.
template <VertexCarrier Carrier>
absl::Status Repairer<Carrier>::Insert(const Sliver& sliver, const Effort& effort) {
  const TetrahedronMeasure measure = MeasureFlatTetrahedron(triangulation_.Corners(sliver.simplex));
  const VertexId v{triangulation_.vertex_count()};
  suspects_.clear();
  hole_.clear();
  // Not found yet; else the best so far.
  uint64_t most = 0;
  double best = effort.may_insert_poor ? measure.cosine : flat_cosine_;
  const double limit = best;
  Point<3> to{};
  for (int k = 0; k < effort.samples && MayTry(k); ++k) {
    const Point<3> p = DrawInBall(measure, k == 0);
    ++report_.operations;
    if (!carrier_.MayHold(triangulation_, p) || !triangulation_.IsInConflict(sliver.simplex, p)) {
      continue;
    }
    const std::optional<double> found = TryAt(sliver.simplex, p, v, limit);
    if (!found.has_value() || (*found > flat_cosine_ && !IsBetter(*found, measure.cosine))) {
      continue;
    }
    const double worst = *found;
    const auto gone = static_cast<uint64_t>(std::count_if(cavity_.simplices.begin(), cavity_.simplices.end(),
                                                          [this](SimplexId s) { return CosineOf(s) > flat_cosine_; }));
    // Good stars first, then many slivers gone, then the best angle.
    const bool is_good = worst <= flat_cosine_;
    const bool was_good = most > 0 && best <= flat_cosine_;
    if ((most == 0 || (is_good != was_good       ? is_good
                       : is_good && gone != most ? gone > most
                                                 : worst < best)) &&
        Accepts(v, p)) {
      most = gone;
      best = worst;
      to = p;
    }
  }
  if (most == 0) {
    return absl::OkStatus();
  }
  if (triangulation_.vertex_count() >= criteria_.max_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat("min_dihedral = ", criteria_.min_dihedral,
                                                     " needs more than max_vertices = ", criteria_.max_vertices,
                                                     " vertices; raise max_vertices or lower min_dihedral"));
  }
  triangulation_.FindCavity(sliver.simplex, to, cavity_);
  if (!nearest_sq_.empty()) {
    nearest_sq_.push_back(NewNearestSq(to, v).value());  // TryAt has found that there is one
  }
  triangulation_.AddVertex();
  is_fixed_.push_back(false);
  triangulation_.Insert(v, to, 0, cavity_, created_);
  ++report_.added;
  Note(created_);
  carrier_.Added(triangulation_, v, NeighbourIn(created_.front(), v));
  observer_.VertexAdded(v, NeighbourIn(created_.front(), v));
  return absl::OkStatus();
}

template class Repairer<BoxCarrier>;
template class Repairer<SurfaceCarrier>;

}  // namespace wellspace::core
