#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <span>
#include <vector>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/directions.h"
#include "core/geometry/vector_product.h"
#include "core/refine/space/corner_sectors.h"
#include "core/refine/space/crease_sampler.h"

namespace wellspace::core {
namespace {

// The smallest angle between two of `ways`.
double LeastAngle(const std::vector<Point<3>>& ways) {
  double least = 180;
  for (size_t i = 0; i < ways.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      least = std::min(least, AngleBetween(ways[i], ways[k]));
    }
  }
  return least;
}

// The angle between opposite sides of a cone, around the tip of which there are so many degrees.
double OpeningOf(double around) { return 360 / std::numbers::pi * std::asin(std::min(around / 360, 1.0)); }

// The sum of the angles of triangles at a point that they all have.
double AngleAround(const SurfaceComplex& complex, uint32_t point, std::span<const uint32_t> triangles) {
  const Point<3>& at = complex.points[point];
  double angle = 0;
  for (const uint32_t t : triangles) {
    const std::array<uint32_t, 3>& corners = complex.triangles[t];
    const size_t k = static_cast<size_t>(std::find(corners.begin(), corners.end(), point) - corners.begin());
    angle += AngleBetween(Difference<3>(complex.points[corners[(k + 1) % 3]], at),
                          Difference<3>(complex.points[corners[(k + 2) % 3]], at));
  }
  return angle;
}

}  // namespace

absl::StatusOr<CreaseAngles> MeasureCreases(const SpatialDomain& domain, const RunContext& context) {
  const SurfaceComplex& complex = domain.complex();
  const SurfaceCurves& curves = domain.curves();
  CreaseAngles angles;
  std::vector<Point<3>> ways;
  size_t steps = 0;
  for (uint32_t curve = 0; curve < domain.curve_count(); ++curve) {
    const std::span<const uint32_t> points = curves.PointsOf(curve);
    PlacedAngle& least = angles.of_curves.emplace_back();
    for (size_t i = 1; i < points.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++, context));
      const Point<3>& a = complex.points[points[i - 1]];
      const Point<3> along = Difference<3>(complex.points[points[i]], a);
      ways.clear();
      for (const TriangleSide side : complex.SidesAt(domain.EdgeOf(points[i - 1], points[i]))) {
        ways.push_back(Across(Difference<3>(complex.points[complex.ApexOf(side)], a), along));
      }
      if (const double angle = LeastAngle(ways); angle < least.angle) {
        least = {angle, a};
      }
    }
  }
  using Tips = std::map<uint32_t, std::vector<uint32_t>>;
  WELLSPACE_ASSIGN_OR_RETURN(const Tips tips, FindTips(domain, context));
  for (uint32_t corner = 0; corner < curves.corners.size(); ++corner) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++, context));
    const Point<3>& at = complex.points[curves.corners[corner]];
    ways.clear();
    for (const SpatialDomain::CurveEnd& end : domain.EndsAt(corner)) {
      const std::span<const uint32_t> points = curves.PointsOf(end.curve);
      ways.push_back(Difference<3>(complex.points[end.is_last ? points[points.size() - 2] : points[1]], at));
    }
    const auto tip = tips.find(curves.corners[corner]);
    angles.of_corners.push_back(
        {tip == tips.end() ? LeastAngle(ways) : OpeningOf(AngleAround(complex, tip->first, tip->second)), at});
  }
  return angles;
}

}  // namespace wellspace::core
