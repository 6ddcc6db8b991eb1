#include "core/refine/space/patch_bends.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/surface_complex.h"
#include "core/geometry/directions.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/refine/space/collar_points.h"

namespace wellspace::core {
namespace {

// Where patches are looked at, as shares of the way to collar points, or to the sphere around a corner.
constexpr std::array<double, 3> kShares = {0.25, 0.5, 0.75};
// The same of the turn around a corner, between two points there.
constexpr std::array<double, 4> kTurns = {0, 0.25, 0.5, 0.75};

double DistanceTo(const Triangle& triangle, const Point<3>& p) { return Distance<3>(p, NearestPoint(triangle, p)); }

// The distance of `p` from two triangles over a quadrangle, whichever diagonal they have in common.
double DistanceToQuad(const std::array<Point<3>, 4>& quad, const Point<3>& p) {
  const auto& [a, b, c, d] = quad;
  return std::max(std::min(DistanceTo({a, b, c}, p), DistanceTo({a, c, d}, p)),
                  std::min(DistanceTo({a, b, d}, p), DistanceTo({b, c, d}, p)));
}

}  // namespace

absl::Status PatchBends::Begin(double most, const RunContext& context) {
  const SurfaceComplex& complex = domain_.complex();
  const std::vector<uint32_t>& patch_of = domain_.curves().patch_of;
  struct Plane {
    Point<3> at{};
    Point<3> normal{};
    double length_sq = 0;
  };
  std::vector<Plane> planes(domain_.curves().patch_count);  // of the largest triangle
  for (uint32_t t = 0; t < complex.triangles.size(); ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context));
    const Triangle triangle = complex.InOrderAt(t);
    const Point<3> normal = NormalOf(triangle);
    Plane& plane = planes[patch_of[t]];
    if (const double length_sq = NormSq<3>(normal); length_sq > plane.length_sq) {
      plane = {triangle[0], normal, length_sq};
    }
  }
  is_flat_.assign(planes.size(), true);
  for (uint32_t t = 0; t < complex.triangles.size(); ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context));
    const Plane& plane = planes[patch_of[t]];
    for (const Point<3>& corner : complex.TriangleAt(t)) {
      // Facets are as near to the plane as what they stand for.
      if (2 * std::abs(Dot<3>(plane.normal, Difference<3>(corner, plane.at))) > most * std::sqrt(plane.length_sq)) {
        is_flat_[patch_of[t]] = false;
      }
    }
  }
  return absl::OkStatus();
}

double PatchBends::BesideCurve(uint32_t curve, double arc, double spacing) const {
  const std::span<const uint32_t> patches = domain_.PatchesAtCurve(curve);
  if (std::all_of(patches.begin(), patches.end(), [this](uint32_t patch) { return is_flat_[patch]; })) {
    return 0;
  }
  const double radius = kCollarShare * spacing;
  const double length = domain_.LengthOf(curve);
  const std::array<double, 3> arcs = {std::max(0.0, arc - 0.5 * spacing), arc, std::min(length, arc + 0.5 * spacing)};
  std::array<Point<3>, 3> at;
  std::array<SidesAtPoint, 3> sides;
  for (size_t k = 0; k < 3; ++k) {
    at[k] = domain_.PointAt(curve, arcs[k]);
    sides[k] = SidesAt(domain_, curve, arcs[k]);
  }
  double most = 0;
  for (size_t i = 0; i < sides[1].patches.size(); ++i) {
    if (is_flat_[sides[1].patches[i]]) {
      continue;
    }
    std::array<size_t, 3> side;  // the same one at each of the three
    for (size_t k = 0; k < 3; ++k) {
      side[k] = SideAlike(sides[k], sides[1].patches[i], sides[1].ways[i]);
    }
    const auto point = [&](size_t k, double share) {
      return PointAcross(domain_, sides[k], side[k], at[k], share * radius);
    };
    const std::array<Point<3>, 4> quad = {at[0], at[2], point(2, 1), point(0, 1)};
    for (const double share : kShares) {
      most = std::max(most, DistanceToQuad(quad, point(1, share)));
    }
    most = std::max({most, DistanceToQuad(quad, point(1, 1)), DistanceToQuad(quad, point(0, 0.5)),
                     DistanceToQuad(quad, point(2, 0.5))});
  }
  return most;
}

double PatchBends::AroundCorner(const CornerSector& sector, double radius) const {
  if (is_flat_[sector.patch]) {
    return 0;
  }
  const Point<3>& centre = domain_.complex().points[domain_.curves().corners[sector.corner]];
  const int parts = sector.PartsOf(sector.turns.back());
  const auto point = [&](double part, double share) {
    const double distance = share * radius;
    const Point<3> way = sector.WayAt(sector.turns.back() * part / parts);
    const Point<3> target = {centre[0] + distance * way[0], centre[1] + distance * way[1],
                             centre[2] + distance * way[2]};
    return PointAround(domain_, sector.patch, target, centre, distance, {});
  };
  double most = 0;
  for (int part = 0; part < parts; ++part) {
    const Triangle facet = {centre, point(part, 1), point(part + 1, 1)};
    for (const double turn : kTurns) {
      for (const double share : kShares) {
        most = std::max(most, DistanceTo(facet, point(part + turn, share)));
      }
    }
  }
  return most;
}

}  // namespace wellspace::core
