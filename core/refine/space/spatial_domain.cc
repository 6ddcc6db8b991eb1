#include "core/refine/space/spatial_domain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/geometry/box_tree.h"
#include "core/geometry/triangle.h"
#include "core/refine/space/collar_points.h"

namespace wellspace::core {
namespace {

// A patch is looked for so many times as far away as it may be, since what is on it is rounded.
constexpr double kReachOfPatch = 1.75;

}  // namespace

SpatialDomain::SpatialDomain(SurfaceComplex complex, Solids solids, SurfaceCurves curves)
    : complex_(std::move(complex)),
      solids_(std::move(solids)),
      curves_(std::move(curves)),
      roles_(solids_.count),
      chains_(curves_.curve_count()) {
  if (curves_.first_point.empty()) {
    curves_.first_point.push_back(0);
  }
  arcs_.reserve(curves_.points.size());
  for (uint32_t curve = 0; curve < curve_count(); ++curve) {
    const std::span<const uint32_t> points = curves_.PointsOf(curve);
    for (size_t i = 0; i < points.size(); ++i) {
      arcs_.push_back(i == 0 ? 0
                             : arcs_.back() + Distance<3>(complex_.points[points[i - 1]], complex_.points[points[i]]));
    }
  }
  FindPatches();
  FindEnds();
}

absl::Status SpatialDomain::BuildIndex(const MortonGrid<3>& grid, const RunContext& context) {
  return index_.Build(complex_, solids_, grid, context);
}

uint32_t SpatialDomain::EdgeOf(uint32_t a, uint32_t b) const {
  const std::array<uint32_t, 2> ends = {std::min(a, b), std::max(a, b)};
  return static_cast<uint32_t>(std::lower_bound(complex_.edges.begin(), complex_.edges.end(), ends) -
                               complex_.edges.begin());
}

// Finds the patches around curves and corners.
void SpatialDomain::FindPatches() {
  has_curves_.assign(curves_.patch_count, false);
  const auto append = [](Rows& rows, std::vector<uint32_t>& patches) {
    std::sort(patches.begin(), patches.end());
    patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
    rows.of.insert(rows.of.end(), patches.begin(), patches.end());
    rows.first.push_back(static_cast<uint32_t>(rows.of.size()));
  };
  patches_at_curve_.first.push_back(0);
  patches_at_corner_.first.push_back(0);
  for (uint32_t curve = 0; curve < curve_count(); ++curve) {
    // They are the same all along it: corners are where they change.
    const std::span<const uint32_t> points = curves_.PointsOf(curve);
    std::vector<uint32_t> patches;
    for (const TriangleSide side : complex_.SidesAt(EdgeOf(points[0], points[1]))) {
      patches.push_back(curves_.patch_of[TriangleOf(side)]);
      has_curves_[patches.back()] = true;
    }
    append(patches_at_curve_, patches);
  }
  solids_at_patch_.resize(curves_.patch_count);
  for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {  // the same all over a patch: edges of others are curves
    solids_at_patch_[curves_.patch_of[t]] = {solids_.solid_of[HalfFacetOf(t, false)],
                                             solids_.solid_of[HalfFacetOf(t, true)]};
  }
  std::vector<std::pair<uint32_t, uint32_t>> around;  // corners, and patches there
  for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
    for (const uint32_t point : complex_.triangles[t]) {
      const auto at = std::lower_bound(curves_.corners.begin(), curves_.corners.end(), point);
      if (at != curves_.corners.end() && *at == point) {
        around.emplace_back(static_cast<uint32_t>(at - curves_.corners.begin()), curves_.patch_of[t]);
      }
    }
  }
  std::sort(around.begin(), around.end());
  auto next = around.begin();
  for (uint32_t corner = 0; corner < curves_.corners.size(); ++corner) {
    std::vector<uint32_t> patches;
    for (; next != around.end() && next->first == corner; ++next) {
      patches.push_back(next->second);
    }
    append(patches_at_corner_, patches);
  }
}

// Finds which curves end in each corner.
void SpatialDomain::FindEnds() {
  std::vector<std::pair<uint32_t, CurveEnd>> ends;
  for (uint32_t curve = 0; curve < curve_count(); ++curve) {
    const std::span<const uint32_t> points = curves_.PointsOf(curve);
    for (const bool is_last : {false, true}) {
      const uint32_t point = is_last ? points.back() : points.front();
      const auto at = std::lower_bound(curves_.corners.begin(), curves_.corners.end(), point);
      if (at != curves_.corners.end() && *at == point) {
        ends.emplace_back(static_cast<uint32_t>(at - curves_.corners.begin()), CurveEnd{curve, is_last});
      }
    }
  }
  std::stable_sort(ends.begin(), ends.end(), [](const auto& s, const auto& t) { return s.first < t.first; });
  first_end_.assign(curves_.corners.size() + 1, 0);
  for (const auto& [corner, end] : ends) {
    ++first_end_[corner + 1];
    ends_at_.push_back(end);
  }
  for (size_t corner = 0; corner < curves_.corners.size(); ++corner) {
    first_end_[corner + 1] += first_end_[corner];
  }
}

std::span<const uint32_t> SpatialDomain::PatchesAt(const SpacePlace& place) const {
  switch (place.kind) {
    case SpacePlace::Kind::kSolid:
      return {};
    case SpacePlace::Kind::kPatch:
    case SpacePlace::Kind::kCollar:
      return {&place.number, 1};
    case SpacePlace::Kind::kCurve:
      return PatchesAtCurve(place.number);
    case SpacePlace::Kind::kCorner:
      break;
  }
  return PatchesAtCorner(place.number);
}

bool SpatialDomain::IsOnPatch(const SpacePlace& place, uint32_t patch) const {
  const std::span<const uint32_t> patches = PatchesAt(place);
  return std::find(patches.begin(), patches.end(), patch) != patches.end();
}

bool SpatialDomain::IsMeshedAt(const SpacePlace& place) const {
  if (!place.IsOnSurface()) {
    return IsMeshed(place.number);
  }
  const std::span<const uint32_t> patches = PatchesAt(place);
  return std::any_of(patches.begin(), patches.end(), [this](uint32_t patch) {
    return IsMeshed(solids_at_patch_[patch][0]) || IsMeshed(solids_at_patch_[patch][1]);
  });
}

Point<3> SpatialDomain::PointAt(uint32_t curve, double arc) const {
  if (IsStrand(curve)) {
    return PointOnStrand(creases_.strands[curve - curve_count()], arc);
  }
  const std::span<const uint32_t> points = curves_.PointsOf(curve);
  const std::span<const double> arcs(arcs_.data() + curves_.first_point[curve], points.size());
  const auto beyond = std::upper_bound(arcs.begin(), arcs.end() - 1, arc);
  const auto i = std::max<std::ptrdiff_t>(beyond - arcs.begin(), 1);
  const double length = arcs[i] - arcs[i - 1];
  const double t = length > 0 ? std::clamp((arc - arcs[i - 1]) / length, 0.0, 1.0) : 0;
  const Point<3>& a = complex_.points[points[i - 1]];
  const Point<3>& b = complex_.points[points[i]];
  Point<3> at;
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = t < 0.5 ? a[axis] + t * (b[axis] - a[axis]) : b[axis] + (1 - t) * (a[axis] - b[axis]);
  }
  return at;
}

double SpatialDomain::DeviationOf(uint32_t curve, double from_arc, double to_arc) const {
  const std::span<const uint32_t> points = curves_.PointsOf(curve);
  const std::span<const double> arcs(arcs_.data() + curves_.first_point[curve], points.size());
  const Point<3> from = PointAt(curve, from_arc);
  const Point<3> to = PointAt(curve, to_arc);
  double most = 0;
  for (auto at = std::upper_bound(arcs.begin(), arcs.end(), from_arc); at != arcs.end() && *at < to_arc; ++at) {
    const Point<3>& p = complex_.points[points[at - arcs.begin()]];
    most = std::max(most, Distance<3>(p, NearestPoint({from, to, to}, p)));
  }
  return most;
}

double SpatialDomain::ArcNear(uint32_t curve, double from_arc, double to_arc, const Point<3>& p) const {
  const std::span<const uint32_t> points = curves_.PointsOf(curve);
  const std::span<const double> arcs(arcs_.data() + curves_.first_point[curve], points.size());
  auto i = std::max<std::ptrdiff_t>(std::upper_bound(arcs.begin(), arcs.end() - 1, from_arc) - arcs.begin(), 1);
  double nearest = from_arc;
  double least_sq = std::numeric_limits<double>::infinity();
  for (; i < std::ssize(arcs) && arcs[i - 1] < to_arc; ++i) {
    const Point<3>& a = complex_.points[points[i - 1]];
    const Point<3> along = Difference<3>(complex_.points[points[i]], a);
    const double length = arcs[i] - arcs[i - 1];
    const double foot = length > 0 ? Dot<3>(Difference<3>(p, a), along) / length : 0;
    const double arc = std::clamp(arcs[i - 1] + foot, std::max(arcs[i - 1], from_arc), std::min(arcs[i], to_arc));
    const double distance_sq = DistanceSq<3>(PointAt(curve, arc), p);
    if (distance_sq < least_sq) {
      least_sq = distance_sq;
      nearest = arc;
    }
  }
  return nearest;
}

double SpatialDomain::ArcAtDistance(const CurveEnd& end, double radius) const {
  const double length = LengthOf(end.curve);
  const auto from_end = [&](double way) { return end.is_last ? length - way : way; };
  if (radius == 0) {
    return from_end(0);
  }
  const std::span<const double> arcs = ArcsOf(end.curve);
  const Point<3> centre = PointAt(end.curve, from_end(0));
  // Beyond the first point of the curve that is out of the ball, which most often is the next one.
  double inside = 0;
  double outside = length;
  for (size_t i = 1; i < arcs.size(); ++i) {
    const double way = from_end(end.is_last ? arcs[arcs.size() - 1 - i] : arcs[i]);
    if (Distance<3>(PointAt(end.curve, from_end(way)), centre) >= radius) {
      outside = way;
      break;
    }
    inside = way;
  }
  if (inside == 0) {
    return from_end(radius);
  }
  for (int round = 0; round < 60; ++round) {
    const double middle = 0.5 * (inside + outside);
    (Distance<3>(PointAt(end.curve, from_end(middle)), centre) < radius ? inside : outside) = middle;
  }
  return from_end(outside);
}

void SpatialDomain::MoveAlong(VertexId v, double along) {
  balls_.Forget();
  SpacePlace& place = places_[Index(v)];
  std::map<double, VertexId>& chain = chains_[place.number];
  auto node = chain.extract(place.along);
  node.key() = along;
  chain.insert(std::move(node));
  place.along = along;
}

void SpatialDomain::AddVertex(const SpacePlace& place) {
  const VertexId v{vertex_count()};
  places_.push_back(place);
  if (place.kind == SpacePlace::Kind::kCorner) {
    for (const CurveEnd& end : EndsAt(place.number)) {
      chains_[end.curve].emplace(end.is_last ? LengthOf(end.curve) : 0, v);
    }
  } else if (place.kind == SpacePlace::Kind::kCurve) {
    std::map<double, VertexId>& chain = chains_[place.number];
    const auto at = chain.emplace(place.along, v).first;
    if (place.along == 0) {
      chain.emplace(LengthOf(place.number), v);
    }
    if (at != chain.begin()) {
      pending_.push_back({place.number, std::prev(at)->first});
    }
    pending_.push_back({place.number, place.along});
    pending_.push_back({place.number, place.along, v});
    ForEachSubsegmentAt(place, [this](const Subsegment& subsegment) { AddBallOf(subsegment); });
    if (IsStrand(place.number)) {
      const uint32_t group = creases_.strands[place.number - curve_count()].group;
      for (uint32_t strand = creases_.first_of_group[group]; strand < creases_.first_of_group[group + 1]; ++strand) {
        if (!HasVertexAt(NumberOfStrand(strand), place.along)) {
          pending_.push_back({NumberOfStrand(strand), place.along, kNoVertex, true});
        }
      }
    }
  }
}

void SpatialDomain::AddBallOf(const Subsegment& subsegment) {
  if (!IsStrand(subsegment.curve)) {
    balls_.Add(PointAt(subsegment.curve, subsegment.from_arc), PointAt(subsegment.curve, subsegment.to_arc));
  }
}

void SpatialDomain::MakeRoom(size_t vertices) {
  if (places_.capacity() - places_.size() < vertices) {
    places_.reserve(std::max(2 * places_.capacity(), places_.size() + vertices));
  }
}

Subsegment SpatialDomain::SubsegmentAt(uint32_t curve, double from_arc) const {
  const auto from = chains_[curve].find(from_arc);
  const auto to = std::next(from);
  return {curve, from_arc, to->first, from->second, to->second};
}

Subsegment SpatialDomain::SubsegmentAround(uint32_t curve, double arc) const {
  return SubsegmentAt(curve, std::prev(chains_[curve].upper_bound(arc))->first);
}

void SpatialDomain::MakeAllPending() {
  std::erase_if(pending_, [](const Pending& pending) { return !pending.is_split; });
  ForEachSubsegmentOf(0, static_cast<uint32_t>(chains_.size()), [this](const Subsegment& s) {
    pending_.push_back({s.curve, s.from_arc});
  });
  balls_.Begin();
  ForEachSubsegment([this](const Subsegment& subsegment) { AddBallOf(subsegment); });
}

void SpatialDomain::TakeCreases(AcuteCreases creases) {
  creases_ = std::move(creases);
  chains_.resize(curve_count() + creases_.strands.size());
  for (const Strand& strand : creases_.strands) {
    patches_at_curve_.of.push_back(strand.patch);
    patches_at_curve_.first.push_back(static_cast<uint32_t>(patches_at_curve_.of.size()));
  }
}

bool SpatialDomain::IsAtAcuteCrease(const Simplex<3>& corners) const {
  return !creases_.IsEmpty() && std::all_of(corners.begin(), corners.end(),
                                            [this](const Point<3>& corner) { return creases_.Encloses(corner); });
}

bool SpatialDomain::IsFrozen(const Subsegment& subsegment) const {
  if (creases_.IsEmpty() || IsStrand(subsegment.curve)) {
    return false;
  }
  const auto& [at_first, at_last] = creases_.balls[subsegment.curve];
  return creases_.is_acute[subsegment.curve] || (at_first > 0 && subsegment.from_arc == 0) ||
         (at_last > 0 && subsegment.to_arc == LengthOf(subsegment.curve));
}

bool SpatialDomain::IsFixed(const SpacePlace& place) const {
  if (place.kind == SpacePlace::Kind::kCollar) {
    return true;
  }
  if (place.kind != SpacePlace::Kind::kCurve || creases_.IsEmpty()) {
    return false;
  }
  bool is_fixed = IsStrand(place.number);
  ForEachSubsegmentAt(place, [&](const Subsegment& subsegment) { is_fixed = is_fixed || IsFrozen(subsegment); });
  return is_fixed;
}

// The point at a parameter of a strand. Beside a curve, its offset from the curve changes evenly from that of the first
// end to that of the other, on all patches alike; around a corner, it is on the sphere of the ball.
Point<3> SpatialDomain::PointOnStrand(const Strand& strand, double share) const {
  const auto& [first, last] = strand.ends;
  if (strand.curve == Strand::kNoCurve) {
    const double radius = strand.radii[0] + share * (strand.radii[1] - strand.radii[0]);
    return PointAround(*this, strand.patch, Between(first.at, last.at, share), strand.centre, radius, {});
  }
  const Point<3> way = Between(Difference<3>(first.at, PointAt(strand.curve, strand.arcs[0])),
                               Difference<3>(last.at, PointAt(strand.curve, strand.arcs[1])), share);
  const Point<3> centre = PointAt(strand.curve, strand.arcs[0] + share * (strand.arcs[1] - strand.arcs[0]));
  const Point<3> target = {centre[0] + way[0], centre[1] + way[1], centre[2] + way[2]};
  return PointAround(*this, strand.patch, target, centre, std::sqrt(NormSq<3>(way)), {});
}

std::optional<Point<3>> SpatialDomain::NearestOnPatch(uint32_t patch, const Point<3>& p, double within) const {
  const std::vector<uint32_t>& patch_of = curves_.patch_of;
  const double reach = kReachOfPatch * within;
  const std::optional<SurfacePoint> nearest =
      index_.NearestOf([&](uint32_t triangle) { return patch_of[triangle] == patch; }, p, reach * reach);
  return nearest.has_value() ? std::optional(nearest->at) : std::nullopt;
}

uint64_t SpatialDomain::MemoryBytes() const {
  constexpr uint64_t kChainBytes = 64;  // of a node of a map
  uint64_t bytes =
      index_.MemoryBytes() + creases_.MemoryBytes() + balls_.MemoryBytes() + places_.size() * sizeof(SpacePlace);
  for (const std::map<double, VertexId>& chain : chains_) {
    bytes += chain.size() * kChainBytes;
  }
  bytes += complex_.triangles.size() *
               (sizeof(complex_.triangles[0]) + sizeof(int32_t) + 8 * sizeof(uint32_t) + sizeof(TriangleSide)) +
           complex_.points.size() * sizeof(Point<3>) + complex_.edges.size() * 3 * sizeof(uint32_t);
  return bytes;
}

}  // namespace wellspace::core
