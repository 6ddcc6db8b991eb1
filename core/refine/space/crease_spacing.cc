#include "core/refine/space/crease_spacing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/triangle.h"
#include "core/refine/space/collar_points.h"
#include "core/refine/space/crease_sampler.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNoCorner = std::numeric_limits<uint32_t>::max();

// Vertices on a curve are no farther apart than this share of the distance to curves that it has no corner with.
constexpr double kShareOfDistance = 1.0 / 3;

// How fast spacings grow along a curve from the ball at its end; and at most, whatever they come from.
constexpr double kGrowthFromBall = 0.5;
constexpr double kGrowth = 0.3;

// A loop without corners has as many vertices.
constexpr double kPartsOfAcuteLoop = 12;

// Spacings are looked at so many times for each vertex, and so many times on a curve at least.
constexpr double kLooksPerVertex = 4;
constexpr double kLeastLooks = 16;

// The bytes of a sample, in a vector that doubles; and memory is asked for so many samples at a time.
constexpr uint64_t kBytesOfSample = 64;
constexpr size_t kSamplesTogether = 4096;

// Chords are kept to this share of the tolerance, since they end elsewhere than where they are looked at.
constexpr double kShareOfTolerance = 0.8;
constexpr double kShorter = 0.7;
// What bends is shortened to so much of that at once, as if it were a circle; but to no less than this.
constexpr double kShareOfBend = 0.9;
constexpr double kMuchShorter = 0.2;

}  // namespace

absl::Status CreaseSpacing::Begin(const std::vector<bool>& is_acute) {
  is_acute_ = &is_acute;
  std::vector<Box<3>> boxes;
  for (uint32_t curve = 0; curve < domain_.curve_count(); ++curve) {
    const std::span<const uint32_t> points = domain_.curves().PointsOf(curve);
    for (size_t i = 1; i < points.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(edges_.size(), context_));
      edges_.push_back({curve, {points[i - 1], points[i]}});
      const Point<3>& a = domain_.complex().points[points[i - 1]];
      boxes.push_back({a, a});
      boxes.back().Include({domain_.complex().points[points[i]], domain_.complex().points[points[i]]});
    }
  }
  corners_.assign(domain_.curve_count(), {kNoCorner, kNoCorner});
  for (uint32_t corner = 0; corner < domain_.curves().corners.size(); ++corner) {
    for (const SpatialDomain::CurveEnd& end : domain_.EndsAt(corner)) {
      corners_[end.curve][end.is_last ? 1 : 0] = corner;
    }
  }
  WELLSPACE_RETURN_IF_ERROR(bends_.Begin(kShareOfTolerance * demands_.tolerance, context_));
  return tree_.Build(std::move(boxes), context_);
}

double CreaseSpacing::DistanceToCurves(const Point<3>& p, double most,
                                       const std::function<bool(uint32_t)>& counts) const {
  double reach = most;
  tree_.ForEach([&](const Box<3>& box) { return DistanceSq<3>(p, box) < reach * reach; },
                [&](uint32_t i) {
                  const CurveEdge& edge = edges_[i];
                  if (counts(edge.curve)) {
                    const Point<3>& a = domain_.complex().points[edge.points[0]];
                    const Point<3>& b = domain_.complex().points[edge.points[1]];
                    reach = std::min(reach, Distance<3>(p, NearestPoint({a, b, b}, p)));
                  }
                });
  return reach;
}

double CreaseSpacing::DistanceToPatches(const Point<3>& p, double most, std::span<const uint32_t> but) const {
  const std::vector<uint32_t>& patch_of = domain_.curves().patch_of;
  const double most_sq = most * most;
  const std::optional<SurfacePoint> nearest = domain_.index().NearestOf(
      [&](uint32_t triangle) { return !std::binary_search(but.begin(), but.end(), patch_of[triangle]); }, p, most_sq);
  return std::sqrt(nearest.has_value() ? nearest->distance_sq : most_sq);
}

bool CreaseSpacing::HasCommonCorner(uint32_t curve, uint32_t other) const {
  const auto is_of = [&](uint32_t corner) {
    return corner != kNoCorner && (corner == corners_[other][0] || corner == corners_[other][1]);
  };
  return is_of(corners_[curve][0]) || is_of(corners_[curve][1]);
}

// The same at `p`, so far along the curve from a corner, for the other curves that end there: collar points are to stay
// between them, those of two acute curves apart.
double CreaseSpacing::SpacingAtCorner(uint32_t curve, const Point<3>& p, double way, uint32_t corner,
                                      double most) const {
  for (const SpatialDomain::CurveEnd& end : domain_.EndsAt(corner)) {
    if (end.curve == curve) {
      continue;
    }
    const double distance = DistanceToCurves(p, way, [&](uint32_t other) { return other == end.curve; });
    if (distance < way * (1 - 1e-9)) {
      const double angle = std::asin(distance / way) / ((*is_acute_)[end.curve] ? 3 : 2);
      most = std::min(most, way * std::tan(angle) / kCollarShare);
    }
  }
  return most;
}

double CreaseSpacing::SpacingAt(uint32_t curve, double arc, double from, double to) const {
  const double length = domain_.LengthOf(curve);
  const Point<3> p = domain_.PointAt(curve, arc);
  const auto& [first, last] = corners_[curve];
  double most = std::min(demands_.edge, first == kNoCorner ? length / kPartsOfAcuteLoop : length);
  if (first != kNoCorner) {
    most = std::min(most, from + kGrowthFromBall * (arc - from));
    most = std::min(most, length - to + kGrowthFromBall * (to - arc));
    most = SpacingAtCorner(curve, p, arc, first, most);
    most = SpacingAtCorner(curve, p, length - arc, last, most);
  }
  most = kShareOfDistance * DistanceToCurves(p, most / kShareOfDistance, [&](uint32_t other) {
           return other != curve && !HasCommonCorner(curve, other);
         });
  most = DistanceToPatches(p, most, domain_.PatchesAtCurve(curve));
  while (most > demands_.min_size &&
         domain_.DeviationOf(curve, std::max(0.0, arc - 0.5 * most), std::min(length, arc + 0.5 * most)) >
             kShareOfTolerance * demands_.tolerance) {
    most *= kShorter;
  }
  return SpacingForBends(curve, arc, most);
}

double CreaseSpacing::SpacingForBends(uint32_t curve, double arc, double most) const {
  const double allowed = kShareOfTolerance * demands_.tolerance;
  while (most > demands_.min_size) {
    const double bend = bends_.BesideCurve(curve, arc, most);
    if (bend <= allowed) {
      break;
    }
    most *= std::clamp(std::sqrt(kShareOfBend * allowed / bend), kMuchShorter, kShorter);
  }
  return most;
}

double CreaseSpacing::RadiusForBends(uint32_t corner, std::span<const CornerSector> sectors, double radius) const {
  const double allowed = kShareOfTolerance * demands_.tolerance;
  const auto bends = [&](const CornerSector& sector) { return bends_.AroundCorner(sector, radius) > allowed; };
  const auto deviates = [&](const SpatialDomain::CurveEnd& end) {
    const double length = domain_.LengthOf(end.curve);
    const double arc = domain_.ArcAtDistance(end, radius);
    return domain_.DeviationOf(end.curve, end.is_last ? arc : 0, end.is_last ? length : arc) > allowed;
  };
  const std::span<const SpatialDomain::CurveEnd> ends = domain_.EndsAt(corner);
  while (radius > demands_.min_size &&
         (std::any_of(ends.begin(), ends.end(), deviates) || std::any_of(sectors.begin(), sectors.end(), bends))) {
    radius *= 0.5;
  }
  return radius;
}

absl::Status CreaseSpacing::TooManyVertices() const {
  return absl::ResourceExhaustedError(
      absl::StrCat("triangles: the acute curves of the surface take more than max_vertices = ", demands_.max_vertices,
                   " vertices; raise max_vertices, or the edge length that is asked for"));
}

absl::StatusOr<std::vector<CreaseSpacing::Sample>> CreaseSpacing::Samples(uint32_t curve, double from, double to,
                                                                          bool is_loop) const {
  std::vector<Sample> samples;
  const double most_step = (to - from) / kLeastLooks;
  const double least_step = (to - from) / (kLooksPerVertex * static_cast<double>(demands_.max_vertices));
  const uint64_t bytes_before = domain_.MemoryBytes();
  double least_vertices = 0;
  for (double arc = from;;) {
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    if (samples.size() % kSamplesTogether == 0) {
      WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(bytes_before + samples.size() * kBytesOfSample));
    }
    const double spacing = SpacingAt(curve, arc, from, to);
    samples.push_back({arc, spacing});
    if (arc == to) {
      break;
    }
    const double step = std::max(std::min(most_step, spacing / kLooksPerVertex), least_step);
    // Spacings only become shorter below; of the vertices between two samples this is no more than half.
    least_vertices += 0.5 * std::min(step, to - arc) / spacing;
    if (!(least_vertices <= static_cast<double>(demands_.max_vertices))) {
      return TooManyVertices();
    }
    arc = to - arc < 1.5 * step ? to : arc + step;
  }
  const auto keep = [&](const Sample& a, Sample& b) {
    b.spacing = std::min(b.spacing, a.spacing + kGrowth * std::abs(b.arc - a.arc));
  };
  for (int round = 0; round < (is_loop ? 2 : 1); ++round) {
    for (size_t i = 1; i < samples.size(); ++i) {
      keep(samples[i - 1], samples[i]);
    }
    for (size_t i = samples.size() - 1; i > 0; --i) {
      keep(samples[i], samples[i - 1]);
    }
    if (is_loop) {
      samples.front().spacing = samples.back().spacing = std::min(samples.front().spacing, samples.back().spacing);
    }
  }
  return samples;
}

absl::StatusOr<std::vector<double>> CreaseSpacing::ArcsAlong(uint32_t curve, double from, double to) const {
  const bool is_loop = corners_[curve][0] == kNoCorner;
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Sample> samples, Samples(curve, from, to, is_loop));
  std::vector<double> passed = {0};  // by sample: how many spacings fit before it
  for (size_t i = 1; i < samples.size(); ++i) {
    passed.push_back(passed.back() + 0.5 * (samples[i].arc - samples[i - 1].arc) *
                                         (1 / samples[i - 1].spacing + 1 / samples[i].spacing));
  }
  const double parts = std::max(1.0, std::ceil(passed.back() * (1 - 1e-9)));
  if (!(parts <= static_cast<double>(demands_.max_vertices))) {
    return TooManyVertices();
  }
  std::vector<double> arcs;
  size_t i = 1;
  for (double k = 0; k < parts; ++k) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(arcs.size(), context_));
    const double wanted = passed.back() * (k / parts);
    while (i + 1 < samples.size() && passed[i] < wanted) {
      ++i;
    }
    const double share = (wanted - passed[i - 1]) / (passed[i] - passed[i - 1]);
    arcs.push_back(k == 0 ? from : samples[i - 1].arc + share * (samples[i].arc - samples[i - 1].arc));
  }
  if (!is_loop) {
    arcs.push_back(to);
  }
  return arcs;
}

}  // namespace wellspace::core
