#include "core/refine/space/collar_points.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "core/geometry/directions.h"

namespace wellspace::core {
namespace {

// Rounds until a point on a patch is at its distance, or as near to that as rounding allows.
constexpr int kMostRounds = 50;
constexpr double kSamePlace = 1e-13;
constexpr double kRounding = 0x1p-50;

}  // namespace

SidesAtPoint SidesAt(const SpatialDomain& domain, uint32_t curve, double arc) {
  const SurfaceComplex& complex = domain.complex();
  const SurfaceCurves& curves = domain.curves();
  const std::span<const uint32_t> points = curves.PointsOf(curve);
  const std::span<const double> arcs = domain.ArcsOf(curve);
  const auto i = std::max<std::ptrdiff_t>(std::upper_bound(arcs.begin(), arcs.end() - 1, arc) - arcs.begin(), 1);
  const Point<3>& a = complex.points[points[i - 1]];
  SidesAtPoint found;
  found.along = Unit(Difference<3>(complex.points[points[i]], a));
  if (arc == arcs[i - 1] && (i > 1 || domain.IsLoop(curve))) {  // across both parts that meet there
    const Point<3>& before = complex.points[points[i > 1 ? i - 2 : std::ssize(points) - 2]];
    const Point<3> other = Unit(Difference<3>(a, before));
    found.along = Unit({found.along[0] + other[0], found.along[1] + other[1], found.along[2] + other[2]});
  }
  for (const TriangleSide side : complex.SidesAt(domain.EdgeOf(points[i - 1], points[i]))) {
    found.patches.push_back(curves.patch_of[TriangleOf(side)]);
    found.ways.push_back(Unit(Across(Difference<3>(complex.points[complex.ApexOf(side)], a), found.along)));
  }
  return found;
}

size_t SideAlike(const SidesAtPoint& sides, uint32_t patch, const Point<3>& way) {
  size_t nearest = sides.patches.size();
  for (size_t i = 0; i < sides.patches.size(); ++i) {
    if (sides.patches[i] == patch &&
        (nearest == sides.patches.size() || Dot<3>(sides.ways[i], way) > Dot<3>(sides.ways[nearest], way))) {
      nearest = i;
    }
  }
  return nearest;
}

Point<3> PointAround(const SpatialDomain& domain, uint32_t patch, const Point<3>& target, const Point<3>& centre,
                     double radius, const Point<3>& along) {
  const double size = std::max({std::abs(target[0]), std::abs(target[1]), std::abs(target[2])});
  const double near_enough = std::max(kSamePlace * radius, kRounding * size);
  Point<3> wanted = target;
  Point<3> on = target;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::optional<Point<3>> nearest = domain.NearestOnPatch(patch, wanted, 2 * radius);
    if (!nearest.has_value()) {
      break;
    }
    on = *nearest;
    Point<3> way = Difference<3>(on, centre);
    if (NormSq<3>(along) > 0) {
      way = Across(way, along);
    }
    const double length = std::sqrt(NormSq<3>(way));
    if (!(length > 0)) {
      break;
    }
    Point<3> next;
    for (int axis = 0; axis < 3; ++axis) {
      next[axis] = centre[axis] + radius / length * way[axis];
    }
    if (Distance<3>(next, on) <= near_enough) {
      break;
    }
    wanted = next;
  }
  return on;
}

Point<3> PointAcross(const SpatialDomain& domain, const SidesAtPoint& sides, size_t i, const Point<3>& at,
                     double radius) {
  const Point<3>& way = sides.ways[i];
  const Point<3> target = {at[0] + radius * way[0], at[1] + radius * way[1], at[2] + radius * way[2]};
  return PointAround(domain, sides.patches[i], target, at, radius, sides.along);
}

}  // namespace wellspace::core
