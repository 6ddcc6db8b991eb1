#include "core/sliver/tetrahedron.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/simplex/quality.h"

// Vectors that are passed and returned never are: all that does so is compiled into its callers.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace wellspace::core {
namespace {

using Lanes = Wide<4>::Lanes;
using Mask = Wide<4>::Mask;
constexpr int kAny = 0;  // a lane that is not used
// A determinant below this times the cube of the extent leaves too few bits of the circumcentre.
constexpr double kExactBelow = 0x1p-24;

struct Vectors {
  Lanes x, y, z;
};

WELLSPACE_INLINE Vectors Shuffle(const Vectors& v, const Mask& lanes) {
  return {WELLSPACE_SHUFFLE(v.x, lanes), WELLSPACE_SHUFFLE(v.y, lanes), WELLSPACE_SHUFFLE(v.z, lanes)};
}
WELLSPACE_INLINE Lanes Dots(const Vectors& a, const Vectors& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
WELLSPACE_INLINE Lanes SquareRoots(const Lanes& x) {
  return Lanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}

WELLSPACE_INLINE TetrahedronMeasure Measure(const Simplex<3>& corners) {
  const auto& [origin, a, b, c] = corners;
  // The edges from the first corner, and the other factor of each in a cross product; the same order for corners.
  const Mask next = {1, 2, 0, kAny};
  const Vectors ends = {{b[0], c[0], a[0], 0}, {b[1], c[1], a[1], 0}, {b[2], c[2], a[2], 0}};
  const Vectors edges = {ends.x - origin[0], ends.y - origin[1], ends.z - origin[2]};
  const Vectors others = Shuffle(edges, next);
  // The areas of the facets that meet in the first corner point inward; that of the fourth is their sum, and points
  // outward.
  Vectors areas = {edges.y * others.z - edges.z * others.y, edges.z * others.x - edges.x * others.z,
                   edges.x * others.y - edges.y * others.x};
  areas.x[3] = areas.x[0] + areas.x[1] + areas.x[2];
  areas.y[3] = areas.y[0] + areas.y[1] + areas.y[2];
  areas.z[3] = areas.z[0] + areas.z[1] + areas.z[2];
  const Lanes inverse = 1 / SquareRoots(Dots(areas, areas));
  // Facets 0 and 1, 1 and 2, 2 and 0, 3 and 0; then 3 and 1, 3 and 2.
  const Mask seconds = {1, 2, 0, 0};
  const Lanes inner = Dots(areas, Shuffle(areas, seconds)) * inverse * WELLSPACE_SHUFFLE(inverse, seconds);
  const Mask outer = {3, 3, kAny, kAny};
  const Mask outer_seconds = {1, 2, kAny, kAny};
  const Lanes rest = Dots(Shuffle(areas, outer), Shuffle(areas, outer_seconds)) * WELLSPACE_SHUFFLE(inverse, outer) *
                     WELLSPACE_SHUFFLE(inverse, outer_seconds);

  TetrahedronMeasure measure;
  measure.cosine = std::max({-inner[0], -inner[1], -inner[2], inner[3], rest[0], rest[1]});
  measure.determinant = edges.x[2] * areas.x[0] + edges.y[2] * areas.y[0] + edges.z[2] * areas.z[0];
  const Lanes lengths_sq = Dots(edges, edges);
  const Lanes opposite_sq = WELLSPACE_SHUFFLE(lengths_sq, Mask{2, 0, 1, kAny});
  const double half = 0.5 / measure.determinant;
  const Vectors terms = {opposite_sq * areas.x, opposite_sq * areas.y, opposite_sq * areas.z};
  const Point<3> offset = {half * (terms.x[0] + terms.x[1] + terms.x[2]), half * (terms.y[0] + terms.y[1] + terms.y[2]),
                           half * (terms.z[0] + terms.z[1] + terms.z[2])};
  for (int i = 0; i < 3; ++i) {
    measure.centre[i] = origin[i] + offset[i];
  }
  measure.radius_sq = NormSq<3>(offset);
  const Vectors next_ends = Shuffle(ends, next);
  const Vectors far_edges = {ends.x - next_ends.x, ends.y - next_ends.y, ends.z - next_ends.z};
  const Lanes far_sq = Dots(far_edges, far_edges);
  const Lanes least_sq = far_sq < lengths_sq ? far_sq : lengths_sq;
  measure.edge_sq = std::min({least_sq[0], least_sq[1], least_sq[2]});
  return measure;
}

WELLSPACE_AVX2 TetrahedronMeasure MeasureAvx2(const Simplex<3>& corners) { return Measure(corners); }

}  // namespace

TetrahedronMeasure MeasureTetrahedron(const Simplex<3>& corners) {
  return MeasureTetrahedron(corners, BestVectorUnit());
}

TetrahedronMeasure MeasureTetrahedron(const Simplex<3>& corners, VectorUnit unit) {
  return unit == VectorUnit::kAvx2 ? MeasureAvx2(corners) : Measure(corners);
}

double FlatCosine(double degrees) {
  return std::ldexp(std::floor(std::ldexp(std::cos(degrees * std::numbers::pi / 180), 30)) - 1, -30);
}

TetrahedronMeasure MeasureFlatTetrahedron(const Simplex<3>& corners) {
  TetrahedronMeasure measure = MeasureTetrahedron(corners);
  double extent_sq = 0;
  for (int i = 1; i < 4; ++i) {
    extent_sq = std::max(extent_sq, DistanceSq<3>(corners[0], corners[i]));
  }
  if (!(measure.determinant > kExactBelow * extent_sq * std::sqrt(extent_sq))) {
    const Point<3> offset = CircumcentreOffset<3>(corners);
    for (int i = 0; i < 3; ++i) {
      measure.centre[i] = corners[0][i] + offset[i];
    }
    measure.radius_sq = NormSq<3>(offset);
  }
  measure.cosine = FlatnessOf(measure);
  return measure;
}

}  // namespace wellspace::core
