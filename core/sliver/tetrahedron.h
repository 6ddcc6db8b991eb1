// What a tetrahedron is worth, in a few dozen operations: for the many that are tried.
#ifndef WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_
#define WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"

namespace wellspace::core {

struct TetrahedronMeasure {
  double cosine = 0;       // of the smallest dihedral angle; the larger, the flatter
  double determinant = 0;  // six times the volume
  double radius_sq = 0;    // of the circumsphere
  double edge_sq = 0;      // the shortest
  Point<3> centre{};       // of the circumsphere
};

inline Point<3> Cross(const Point<3>& a, const Point<3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Measures a tetrahedron in doubles.
//
// Shapes:     corners: positively oriented.
// Guarantees: (1) for one whose angles are above a degree relative errors are below 1e-12; a flat one may have NaN, which
//             passes for no bound.
// Complexity: O(1), four square roots.
// Errors:     none.
inline TetrahedronMeasure MeasureTetrahedron(const Simplex<3>& corners) {
  const Point<3> u = Difference<3>(corners[1], corners[0]);
  const Point<3> v = Difference<3>(corners[2], corners[0]);
  const Point<3> w = Difference<3>(corners[3], corners[0]);
  // The areas of the facets that meet in corner 0 point inward; that of the fourth is their sum, and points outward.
  const std::array<Point<3>, 3> inward = {Cross(v, w), Cross(w, u), Cross(u, v)};
  Point<3> outward;
  std::array<double, 3> inverse;
  for (int i = 0; i < 3; ++i) {
    outward[i] = inward[0][i] + inward[1][i] + inward[2][i];
    inverse[i] = 1 / std::sqrt(NormSq<3>(inward[i]));
  }
  const double outward_inverse = 1 / std::sqrt(NormSq<3>(outward));
  TetrahedronMeasure measure;
  measure.cosine = std::max({-Dot<3>(inward[0], inward[1]) * inverse[0] * inverse[1],
                             -Dot<3>(inward[1], inward[2]) * inverse[1] * inverse[2],
                             -Dot<3>(inward[2], inward[0]) * inverse[2] * inverse[0],
                             Dot<3>(outward, inward[0]) * outward_inverse * inverse[0],
                             Dot<3>(outward, inward[1]) * outward_inverse * inverse[1],
                             Dot<3>(outward, inward[2]) * outward_inverse * inverse[2]});
  measure.determinant = Dot<3>(u, inward[0]);
  const std::array<double, 3> lengths_sq = {NormSq<3>(u), NormSq<3>(v), NormSq<3>(w)};
  const double half = 0.5 / measure.determinant;
  Point<3> offset;
  for (int i = 0; i < 3; ++i) {
    offset[i] = half * (lengths_sq[0] * inward[0][i] + lengths_sq[1] * inward[1][i] + lengths_sq[2] * inward[2][i]);
    measure.centre[i] = corners[0][i] + offset[i];
  }
  measure.radius_sq = NormSq<3>(offset);
  measure.edge_sq = std::min({lengths_sq[0], lengths_sq[1], lengths_sq[2], DistanceSq<3>(corners[1], corners[2]),
                              DistanceSq<3>(corners[1], corners[3]), DistanceSq<3>(corners[2], corners[3])});
  return measure;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_
