#include "core/sliver/mend.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

// Cosines: of what has not been measured, and of what may not be.
constexpr double kUnknown = -2;
constexpr double kForbidden = 2;

// A vertex moves by at most this times the distance to its nearest neighbour.
constexpr double kReach = 0.4;
// A new vertex lies in the sliver's circumball shrunk by this.
constexpr double kInside = 0.95;
// Places that are tried for a vertex; where few slivers are left after some passes, more: so many for all of them.
constexpr int kSamples = 24;
constexpr int kMostSamples = 1536;
constexpr int kLateSamples = 4096;
// Slivers are looked at again in so many passes at most, and in each at most so many times as many as it began with:
// every step makes the flattest it touches better, but nothing says by how much in all.
constexpr int kPasses = 40;
constexpr int kEarlyPasses = 4;
constexpr size_t kGrowth = 8;
constexpr size_t kLeastGrowth = 1000;
// A step that leaves a sliver has to make 1 - cosine, nearly half the angle squared, larger by this.
constexpr double kGain = 1.1;

// Slightly below the cosine of the angle, and the same on every machine: cosines of different libraries differ in the
// last bit.
double FlatCosine(double degrees) {
  return std::ldexp(std::floor(std::ldexp(std::cos(degrees * std::numbers::pi / 180), 30)) - 1, -30);
}

bool IsBetter(double cosine, double than) { return 1 - cosine >= kGain * (1 - than); }

}  // namespace

Mender::Mender(Triangulation<3>& triangulation, std::vector<bool>& is_fixed, const MendDemands& demands,
               MendObserver& observer)
    : triangulation_(triangulation),
      is_fixed_(is_fixed),
      demands_(demands),
      observer_(observer),
      flat_cosine_(FlatCosine(demands.min_dihedral)) {}

absl::Status Mender::Run(RunContext& context) {
  if (demands_.demands.criterion == Criterion::kWellSpaced) {
    WELLSPACE_ASSIGN_OR_RETURN(nearest_sq_, triangulation_.NearestDistancesSq(context));
  }
  next_.clear();
  for (uint32_t i = 0; i < triangulation_.simplex_limit(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const SimplexId s{i};
    if (triangulation_.IsIn(s) && CosineOf(s) > flat_cosine_) {
      next_.push_back({s, triangulation_.item(s).vertices});
    }
  }
  report_.slivers += next_.size();
  report_.slivers_left = next_.size();
  for (int pass = 0; pass < kPasses && !next_.empty(); ++pass) {
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(observer_.MemoryBytes() + triangulation_.MemoryBytes() +
                                                  cosine_.size() * sizeof(double) + next_.size() * sizeof(Sliver)));
    Effort effort;
    effort.samples = pass < kEarlyPasses
                         ? kSamples
                         : std::clamp(kLateSamples / static_cast<int>(std::min<size_t>(next_.size(), kLateSamples)),
                                      kSamples, kMostSamples);
    effort.may_move_neighbours = pass >= 1;
    effort.may_insert = pass >= 2;
    effort.may_insert_poor = pass > kEarlyPasses;
    const size_t limit = kGrowth * next_.size() + kLeastGrowth;
    std::vector<Sliver> left;
    for (size_t k = 0; k < next_.size(); ++k) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      const Sliver sliver = next_[k];
      if (IsThere(sliver) && (k >= limit || !Mend(sliver, effort))) {
        if (k < limit && effort.may_insert) {
          WELLSPACE_RETURN_IF_ERROR(Insert(sliver, effort));
          context.SetVertices(triangulation_.vertex_count());
        }
        left.push_back(sliver);
      }
      context.SetPhaseFraction(1 - static_cast<double>(left.size() + next_.size() - k) /
                                       static_cast<double>(report_.slivers + next_.size()));
    }
    next_.clear();
    std::copy_if(left.begin(), left.end(), std::back_inserter(next_), [this](const Sliver& s) { return IsThere(s); });
    report_.slivers_left = next_.size();
  }
  return absl::OkStatus();
}

bool Mender::IsThere(const Sliver& sliver) {
  return triangulation_.IsIn(sliver.simplex) && triangulation_.item(sliver.simplex).vertices == sliver.vertices &&
         CosineOf(sliver.simplex) > flat_cosine_;
}

double Mender::CosineOf(SimplexId s) {
  if (Index(s) >= cosine_.size()) {
    cosine_.resize(triangulation_.simplex_limit(), kUnknown);
  }
  double& cosine = cosine_[Index(s)];
  if (cosine == kUnknown) {
    cosine = MeasureTetrahedron(triangulation_.Corners(s)).cosine;
  }
  return cosine;
}

// Whether the demands allow for a tetrahedron, of which `moved` is the vertex whose nearest neighbour is that of the last
// KeepsNearestNeighbours.
bool Mender::IsAdmissible(const TetrahedronMeasure& measure, const std::array<VertexId, 4>& vertices,
                          VertexId moved) const {
  const Demands<3>& demands = demands_.demands;
  const double rho_sq = demands.rho * demands.rho;
  // Comparisons with NaN fail.
  if (!(measure.determinant > 0 && measure.radius_sq <= rho_sq * measure.edge_sq &&
        measure.edge_sq >= demands_.min_edge * demands_.min_edge && triangulation_.box().Contains(measure.centre))) {
    return false;
  }
  if (demands.criterion == Criterion::kWellSpaced) {
    for (const VertexId u : vertices) {
      if (!(measure.radius_sq <= rho_sq * (u == moved ? edge_limit_sq_ : nearest_sq_[Index(u)]))) {
        return false;
      }
    }
  }
  return demands.sizes.IsUnbounded() || measure.radius_sq <= demands.sizes.AtSq(measure.centre);
}

// Under well-spaced: whether a vertex at `p`, which would replace the cavity, is nobody's new nearest neighbour.
bool Mender::KeepsNearestNeighbours(const Point<3>& p, VertexId moved) {
  if (demands_.demands.criterion != Criterion::kWellSpaced) {
    return true;
  }
  edge_limit_sq_ = std::numeric_limits<double>::infinity();
  for (const auto& [s, slot] : cavity_.boundary) {
    const auto& vertices = triangulation_.item(s).vertices;
    for (int i = 0; i < 4; ++i) {
      if (i != slot && vertices[i] != moved) {
        const double distance_sq = DistanceSq<3>(triangulation_.point(vertices[i]), p);
        if (distance_sq < nearest_sq_[Index(vertices[i])]) {
          return false;
        }
        edge_limit_sq_ = std::min(edge_limit_sq_, distance_sq);
      }
    }
  }
  return true;
}

// The largest cosine in the star of vertex `v` at `p`, for the cavity that was found; kForbidden if one is not below
// `limit`, or the demands do not allow for it.
double Mender::TryAt(const Point<3>& p, VertexId v, double limit) {
  if (!KeepsNearestNeighbours(p, v)) {
    return kForbidden;
  }
  double worst = -1;
  for (const auto& [s, slot] : cavity_.boundary) {
    std::array<VertexId, 4> vertices = triangulation_.item(s).vertices;
    Simplex<3> corners = triangulation_.Corners(s);
    vertices[slot] = v;
    corners[slot] = p;
    const TetrahedronMeasure measure = MeasureTetrahedron(corners);
    if (!(measure.cosine < limit && IsAdmissible(measure, vertices, v))) {
      return kForbidden;
    }
    worst = std::max(worst, measure.cosine);
  }
  return worst;
}

// Measures new tetrahedra; slivers among them will be looked at.
void Mender::Note(std::span<const SimplexId> created) {
  cosine_.resize(triangulation_.simplex_limit(), kUnknown);
  for (const SimplexId s : created) {
    const auto& vertices = triangulation_.item(s).vertices;
    changed_.insert(changed_.end(), vertices.begin(), vertices.end());
    cosine_[Index(s)] = kUnknown;
    if (CosineOf(s) > flat_cosine_) {
      next_.push_back({s, vertices});
    }
  }
}

// Tells whose stars have changed since the last time.
void Mender::ReportStars() {
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  for (const VertexId v : changed_) {
    observer_.StarChanged(v);
  }
  changed_.clear();
}

// SplitMix64: Steele, Lea and Flood 2014.
Point<3> Mender::RandomInBall() {
  Point<3> p;
  do {
    for (double& x : p) {
      random_ += 0x9e3779b97f4a7c15;
      uint64_t z = random_;
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
      z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
      x = static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1;
    }
  } while (NormSq<3>(p) > 1);
  return p;
}

// Moves vertices of the sliver, or next to it. Returns whether the sliver has gone.
bool Mender::Mend(const Sliver& sliver, const Effort& effort) {
  for (const VertexId v : sliver.vertices) {
    if (!is_fixed_[Index(v)] && Move(v, sliver, effort.samples)) {
      return true;
    }
  }
  for (int i = 0; i < 4 && effort.may_move_neighbours; ++i) {
    const SimplexId beyond = triangulation_.item(sliver.simplex).neighbours[i];
    if (beyond != kNoSimplex) {
      const auto& item = triangulation_.item(beyond);
      const VertexId v = item.vertices[item.SlotOf(sliver.simplex)];
      if (!is_fixed_[Index(v)] && Move(v, sliver, effort.samples)) {
        return true;
      }
    }
  }
  return false;
}

// Looks for a better place of `v` nearby or, if it is no vertex of the sliver, on the way to the sliver's circumcentre,
// such that the sliver goes and all that replaces what the move destroys is better than the flattest of that. Returns
// whether it has moved.
bool Mender::Move(VertexId v, const Sliver& sliver, int samples) {
  const Point<3> from = triangulation_.point(v);
  const FaceMask faces = triangulation_.faces(v);
  const Box<3>& box = triangulation_.box();
  const bool is_own = std::find(sliver.vertices.begin(), sliver.vertices.end(), v) != sliver.vertices.end();
  triangulation_.Star(v, star_);
  double old = CosineOf(sliver.simplex);
  double edge_sq = std::numeric_limits<double>::infinity();
  for (const SimplexId s : star_) {
    old = std::max(old, CosineOf(s));
    for (const VertexId u : triangulation_.item(s).vertices) {
      if (u != v) {
        edge_sq = std::min(edge_sq, DistanceSq<3>(from, triangulation_.point(u)));
      }
    }
  }
  Point<3> way{};
  if (!is_own) {
    way = Difference<3>(MeasureTetrahedron(triangulation_.Corners(sliver.simplex)).centre, from);
  }
  triangulation_.Remove(v, hole_);
  hole_cosine_.clear();
  for (const SimplexId s : hole_) {
    const TetrahedronMeasure measure = MeasureTetrahedron(triangulation_.Corners(s));
    const bool is_admissible = IsAdmissible(measure, triangulation_.item(s).vertices, v);
    hole_cosine_.push_back(is_admissible ? measure.cosine : kForbidden);
  }
  const auto find_cavity = [&](const Point<3>& p) {
    for (const SimplexId s : hole_) {
      if (triangulation_.IsInConflict(s, p)) {
        triangulation_.FindCavity(s, p, cavity_);
        return true;
      }
    }
    return false;
  };
  const double reach = kReach * std::sqrt(edge_sq);
  double best = old;
  Point<3> to = from;
  for (int k = 0; k < samples && best > flat_cosine_; ++k) {
    Point<3> p = RandomInBall();
    const double share = is_own ? 0 : 0.5 * (1 + RandomInBall()[0]);
    for (int i = 0; i < 3; ++i) {
      p[i] = from[i] + reach * p[i] + share * way[i];
    }
    for (int face = 0; face < 6; ++face) {
      if (((faces >> face) & 1) != 0) {
        p[face / 2] = box.FaceCoordinate(face);
      }
    }
    if (!box.Contains(p) || box.FacesOf(p) != faces || (!is_own && !triangulation_.IsInConflict(sliver.simplex, p)) ||
        !find_cavity(p)) {
      continue;
    }
    double worst = -1;
    for (size_t i = 0; i < hole_.size(); ++i) {
      worst = triangulation_.IsInCavity(hole_[i]) ? worst : std::max(worst, hole_cosine_[i]);
    }
    if (worst < best) {
      worst = std::max(worst, TryAt(p, v, best));
      if (worst < best && (worst <= flat_cosine_ || IsBetter(worst, old))) {
        best = worst;
        to = p;
      }
    }
  }
  if (best == old) {
    triangulation_.Restore();
    return false;
  }
  find_cavity(to);
  KeepsNearestNeighbours(to, v);
  if (!nearest_sq_.empty()) {
    nearest_sq_[Index(v)] = edge_limit_sq_;
  }
  std::erase_if(hole_, [this](SimplexId s) { return triangulation_.IsInCavity(s); });
  triangulation_.Insert(v, to, 0, cavity_, created_);
  ++report_.moves;
  Note(hole_);
  Note(created_);
  observer_.VertexMoved(v);
  ReportStars();
  return true;
}

// Adds a vertex in the sliver's circumball: of the places whose star is good, that which does away with most slivers.
absl::Status Mender::Insert(const Sliver& sliver, const Effort& effort) {
  const TetrahedronMeasure measure = MeasureTetrahedron(triangulation_.Corners(sliver.simplex));
  const Box<3>& box = triangulation_.box();
  const VertexId v{triangulation_.vertex_count()};
  const double radius = kInside * std::sqrt(measure.radius_sq);
  // Not found yet; else the best so far.
  uint64_t most = 0;
  double best = effort.may_insert_poor ? measure.cosine : flat_cosine_;
  const double limit = best;
  Point<3> to{};
  for (int k = 0; k < effort.samples; ++k) {
    Point<3> p = k == 0 ? Point<3>{} : RandomInBall();
    for (int i = 0; i < 3; ++i) {
      p[i] = measure.centre[i] + radius * p[i];
    }
    if (!box.Contains(p) || box.FacesOf(p) != 0 || !triangulation_.IsInConflict(sliver.simplex, p)) {
      continue;
    }
    triangulation_.FindCavity(sliver.simplex, p, cavity_);
    const auto gone = static_cast<uint64_t>(std::count_if(cavity_.simplices.begin(), cavity_.simplices.end(),
                                                          [this](SimplexId s) { return CosineOf(s) > flat_cosine_; }));
    const double worst = TryAt(p, v, limit);
    if (worst > flat_cosine_ && !IsBetter(worst, measure.cosine)) {
      continue;
    }
    // Good stars first, then many slivers gone, then the best angle.
    const bool is_good = worst <= flat_cosine_;
    const bool was_good = most > 0 && best <= flat_cosine_;
    if (most == 0 || (is_good != was_good ? is_good : is_good && gone != most ? gone > most : worst < best)) {
      most = gone;
      best = worst;
      to = p;
    }
  }
  if (most == 0) {
    return absl::OkStatus();
  }
  if (triangulation_.vertex_count() >= demands_.max_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat("min_dihedral = ", demands_.min_dihedral,
                                                     " needs more than max_vertices = ", demands_.max_vertices,
                                                     " vertices; raise max_vertices or lower min_dihedral"));
  }
  triangulation_.FindCavity(sliver.simplex, to, cavity_);
  KeepsNearestNeighbours(to, v);
  triangulation_.AddVertex();
  is_fixed_.push_back(false);
  if (!nearest_sq_.empty()) {
    nearest_sq_.push_back(edge_limit_sq_);
  }
  triangulation_.Insert(v, to, 0, cavity_, created_);
  ++report_.added;
  Note(created_);
  const auto& vertices = triangulation_.item(created_.front()).vertices;
  observer_.VertexAdded(v, vertices[vertices[0] == v ? 1 : 0]);
  ReportStars();
  return absl::OkStatus();
}

}  // namespace wellspace::core
