// Where planes meet, in doubles, and how far that may be from where they meet exactly.
#ifndef WELLSPACE_CORE_VORONOI_MEETING_POINT_H_
#define WELLSPACE_CORE_VORONOI_MEETING_POINT_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"
#include "core/voronoi/cell_parts.h"

namespace wellspace::core {

// A node in doubles, and a bound on |x - exact x|; infinite where there is none.
template <int D>
struct Placement {
  Point<D> x;
  double radius = 0;  // |x|
  double error = std::numeric_limits<double>::infinity();
};

// The meeting point of D planes by Cramer's rule, D <= 3.
//
// With a_j = |n_j|, P = prod a_j and S = sum_j |c_j| P / a_j, the numerators are sums of products bounded by S, the
// determinant by sqrt(D) P; each factor carries at most one rounding (n) or D + 3 (c), each product and sum one more: at
// most 14 u for D <= 3. So, where |det| > 256 u P, a coordinate is wrong by at most 18 u (S + |x| P) / |det|, and x by
// sqrt(D) < 2 times that; 64 u is used.
template <int D>
Placement<D> Meet(const std::array<const Plane<D>*, D>& planes) requires(D <= 3) {
  Placement<D> placed;
  double determinant = 0;
  double inverse = 0;
  if constexpr (D == 2) {
    const Point<2>& a = planes[0]->normal;
    const Point<2>& b = planes[1]->normal;
    determinant = a[0] * b[1] - a[1] * b[0];
    inverse = 1 / determinant;
    placed.x[0] = (planes[0]->offset * b[1] - planes[1]->offset * a[1]) * inverse;
    placed.x[1] = (planes[1]->offset * a[0] - planes[0]->offset * b[0]) * inverse;
  } else {
    const auto cross = [](const Point<3>& a, const Point<3>& b) {
      return Point<3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const Point<3> bc = cross(planes[1]->normal, planes[2]->normal);
    const Point<3> ca = cross(planes[2]->normal, planes[0]->normal);
    const Point<3> ab = cross(planes[0]->normal, planes[1]->normal);
    determinant = Dot<3>(planes[0]->normal, bc);
    inverse = 1 / determinant;
    for (int i = 0; i < 3; ++i) {
      placed.x[i] = (planes[0]->offset * bc[i] + planes[1]->offset * ca[i] + planes[2]->offset * ab[i]) * inverse;
    }
  }
  double product = 1;
  double sum = 0;
  for (const Plane<D>* plane : planes) {
    product *= plane->length;
    sum += plane->distance;
  }
  placed.radius = std::sqrt(NormSq<D>(placed.x));
  if (std::abs(determinant) > 256 * kUnit * product) {
    placed.error = 64 * kUnit * product * (sum + placed.radius) * std::abs(inverse);
  }
  return placed;
}

// The same by an approximate inverse and the residual, D > 3.
//
// Divide each plane by the length of its normal as computed, which is as good a scale as the exact one: A x = c, and let
// A*, c*, x* be the exact ones. The rows of A carry at most 3 u each (difference, quotient; with lengths a few u off 1),
// c at most (D + 6) u |c|, in norm. Let Y be any matrix and F = |Y A - I| in the Frobenius norm, computed with an error
// below (D + 1) u (|Y| |A| + sqrt(D)) < (2 D + 4) u |Y| |A|, |A| = sqrt(D), since sqrt(D) <= |Y| |A| + F; that of A* adds
// 3 u |Y| sqrt(D). If F* <= 1/2 then |A*^-1| <= 2 |Y|. The residual r = A x - c, computed with an error below (D + 2) u
// (|a_j| |x| + |c_j|) in each component, differs from A* x - c* by 3 u |x| + (D + 6) u |c_j| more; so |x - x*| <= 2 |Y|
// (|r| + (2 D + 10) u sqrt(D) (|x| + max |c|)).
template <int D>
Placement<D> Meet(const std::array<const Plane<D>*, D>& planes) requires(D > 3) {
  std::array<Point<D>, D> a;
  Point<D> c;
  double largest_offset = 0;
  for (int j = 0; j < D; ++j) {
    for (int i = 0; i < D; ++i) {
      a[j][i] = planes[j]->normal[i] / planes[j]->length;
    }
    c[j] = planes[j]->offset / planes[j]->length;
    largest_offset = std::max(largest_offset, std::abs(c[j]));
  }
  // Gauss and Jordan with row pivots turn the left half into I and the right half into Y.
  std::array<std::array<double, 2 * D>, D> m{};
  for (int j = 0; j < D; ++j) {
    std::copy(a[j].begin(), a[j].end(), m[j].begin());
    m[j][D + j] = 1;
  }
  for (int k = 0; k < D; ++k) {
    int pivot = k;
    for (int j = k + 1; j < D; ++j) {
      pivot = std::abs(m[j][k]) > std::abs(m[pivot][k]) ? j : pivot;
    }
    if (m[pivot][k] == 0) {
      return {};
    }
    std::swap(m[k], m[pivot]);
    const double inverse = 1 / m[k][k];
    for (int i = k; i < 2 * D; ++i) {
      m[k][i] *= inverse;
    }
    for (int j = 0; j < D; ++j) {
      const double factor = m[j][k];
      for (int i = k; i < 2 * D && j != k; ++i) {
        m[j][i] -= factor * m[k][i];
      }
    }
  }
  Placement<D> placed;
  double inverse_sq = 0;
  double defect_sq = 0;
  for (int i = 0; i < D; ++i) {
    placed.x[i] = 0;
    for (int j = 0; j < D; ++j) {
      placed.x[i] += m[i][D + j] * c[j];
      inverse_sq += m[i][D + j] * m[i][D + j];
      double entry = i == j ? -1 : 0;
      for (int k = 0; k < D; ++k) {
        entry += m[i][D + k] * a[k][j];
      }
      defect_sq += entry * entry;
    }
  }
  const double root = std::sqrt(static_cast<double>(D));
  const double inverse_norm = std::sqrt(inverse_sq);
  if (!(std::sqrt(defect_sq) + (2 * D + 8) * kUnit * root * inverse_norm < 0.5)) {
    return placed;
  }
  double residual_sq = 0;
  for (int j = 0; j < D; ++j) {
    const double r = Dot<D>(a[j], placed.x) - c[j];
    residual_sq += r * r;
  }
  // One more part in a hundred pays for the roundings of the bound itself.
  placed.radius = std::sqrt(NormSq<D>(placed.x));
  placed.error =
      2.02 * inverse_norm * (std::sqrt(residual_sq) + (2 * D + 10) * kUnit * root * (placed.radius + largest_offset));
  return placed;
}

// A placed node is wrong by at most this share of its distance from the site. What is sure of nodes by twice as much does not
// depend on how they were placed.
inline constexpr double kPlaced = 0x1p-20;

// Computes where planes of a cell, in their order, meet, exactly where they are too nearly dependent for doubles, and returns the
// slack.
template <int D>
double PlaceByPlanes(const Point<D>& site, const std::array<const Plane<D>*, D>& planes, Point<D>& x) {
  Placement<D> placed = Meet<D>(planes);
  if (std::all_of(planes.begin(), planes.end(),
                  [](const Plane<D>* plane) { return plane->kind != PlaneKind::kBisector; })) {
    placed.error = 0;  // walls are at right angles
  } else if (!(std::isfinite(placed.error) && placed.error <= kPlaced * placed.radius)) {
    std::array<PlaneSource<D>, D> sources;
    for (int k = 0; k < D; ++k) {
      sources[k] = planes[k]->source;
    }
    placed.x = ExactMeetingPoint<D>(site, sources);
    placed.radius = std::sqrt(NormSq<D>(placed.x));
    placed.error = 8 * kUnit * placed.radius;
  }
  x = placed.x;
  return placed.error + 16 * kUnit * placed.radius;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_MEETING_POINT_H_
