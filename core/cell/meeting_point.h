// Meeting points of D planes in doubles, and bounds on their distances from the exact ones: Place computes one for each
// node.
//
//   PlaceNode, PlaceByPlanes   called by cells: Meet, or ExactMeetingPoint where its bound is not good enough
//   Meet                       D <= 3 by Cramer's rule, D > 3 by an approximate inverse; the bound is derived there
//   MeetInSpace                Meet in 3-D, also of four nodes side by side (Polyhedron::PlaceTogether)
//
// u = kUnit = 2^-53 is the unit of rounding.
#ifndef WELLSPACE_CORE_CELL_MEETING_POINT_H_
#define WELLSPACE_CORE_CELL_MEETING_POINT_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "core/base/simd/lanes.h"
#include "core/cell/cell_parts.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// A node in doubles, and a bound on |x - exact x|; infinite where there is none.
template <int D>
struct Placement {
  Point<D> x;
  double radius = 0;  // |x|
  double error = std::numeric_limits<double>::infinity();
};

// A number for a node, or for so many side by side.
template <size_t kNodes>
struct PerNode {
  using Type = typename Wide<kNodes>::Lanes;
};
template <>
struct PerNode<1> {
  using Type = double;
};

// The three planes of a node in space, or of each of so many; as of Plane.
template <size_t kNodes>
struct SpacePlanes {
  using T = typename PerNode<kNodes>::Type;
  T normal[3][3];  // by plane and axis
  T offset[3];
  T length[3];
  T distance[3];
};

// Placements of so many.
template <size_t kNodes>
struct SpacePlacements {
  using T = typename PerNode<kNodes>::Type;
  T x[3];
  T radius_sq;
  T radius;
  T error;
};

// The meeting point of three planes by Cramer's rule. The bound is derived for D <= 3.
//
// With a_j = |n_j|, P = prod a_j and S = sum_j |c_j| P / a_j, the numerators are sums of products bounded by S, the
// determinant by sqrt(D) P; each factor carries at most one rounding (n) or D + 3 (c), each product and sum one more:
// at most 14 u for D <= 3. So, where |det| > 256 u P, a coordinate is wrong by at most 18 u (S + |x| P) / |det|, and x
// by sqrt(D) < 2 times that; 64 u is used.
template <size_t kNodes>
WELLSPACE_INLINE void MeetInSpace(const SpacePlanes<kNodes>& planes, SpacePlacements<kNodes>& placed) {
  using T = typename PerNode<kNodes>::Type;
  const auto cross = [](const T(&a)[3], const T(&b)[3], T(&out)[3]) __attribute__((always_inline)) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
  };
  const T(&n)[3][3] = planes.normal;
  T bc[3];
  T ca[3];
  T ab[3];
  cross(n[1], n[2], bc);
  cross(n[2], n[0], ca);
  cross(n[0], n[1], ab);
  const T determinant = n[0][0] * bc[0] + n[0][1] * bc[1] + n[0][2] * bc[2];
  const T inverse = 1 / determinant;
  for (int i = 0; i < 3; ++i) {
    placed.x[i] = (planes.offset[0] * bc[i] + planes.offset[1] * ca[i] + planes.offset[2] * ab[i]) * inverse;
  }
  const T product = planes.length[0] * planes.length[1] * planes.length[2];
  const T sum = planes.distance[0] + planes.distance[1] + planes.distance[2];
  placed.radius_sq = placed.x[0] * placed.x[0] + placed.x[1] * placed.x[1] + placed.x[2] * placed.x[2];
  if constexpr (kNodes == 1) {
    placed.radius = std::sqrt(placed.radius_sq);
  } else {
    for (size_t node = 0; node < kNodes; ++node) {
      placed.radius[node] = std::sqrt(placed.radius_sq[node]);
    }
  }
  const T size = determinant < 0 ? -determinant : determinant;
  const T inverse_size = inverse < 0 ? -inverse : inverse;
  const T error = 64 * kUnit * product * (sum + placed.radius) * inverse_size;
  const T none = std::numeric_limits<double>::infinity() + T{};
  placed.error = size > 256 * kUnit * product ? error : none;
}

// Cramer's rule, with the bound of MeetInSpace.
template <int D>
Placement<D> Meet(const std::array<const Plane<D>*, D>& planes) requires(D == 2) {
  Placement<D> placed;
  const Point<2>& a = planes[0]->normal;
  const Point<2>& b = planes[1]->normal;
  const double determinant = a[0] * b[1] - a[1] * b[0];
  const double inverse = 1 / determinant;
  placed.x[0] = (planes[0]->offset * b[1] - planes[1]->offset * a[1]) * inverse;
  placed.x[1] = (planes[1]->offset * a[0] - planes[0]->offset * b[0]) * inverse;
  placed.radius = std::sqrt(NormSq<D>(placed.x));
  const double product = planes[0]->length * planes[1]->length;
  if (std::abs(determinant) > 256 * kUnit * product) {
    const double sum = planes[0]->distance + planes[1]->distance;
    placed.error = 64 * kUnit * product * (sum + placed.radius) * std::abs(inverse);
  }
  return placed;
}

// MeetInSpace of one node.
template <int D>
Placement<D> Meet(const std::array<const Plane<D>*, D>& planes) requires(D == 3) {
  SpacePlanes<1> three;
  for (int k = 0; k < D; ++k) {
    std::copy_n(planes[k]->normal.begin(), D, three.normal[k]);
    three.offset[k] = planes[k]->offset;
    three.length[k] = planes[k]->length;
    three.distance[k] = planes[k]->distance;
  }
  SpacePlacements<1> at;
  MeetInSpace<1>(three, at);
  return {{at.x[0], at.x[1], at.x[2]}, at.radius, at.error};
}

// Puts I and an approximate inverse of `a` side by side into `m`, by Gauss and Jordan with row pivots; false where a
// pivot is zero. Compiled into Meet, of which a call would take a fifth more.
template <int D>
WELLSPACE_INLINE bool InvertRoughly(const std::array<Point<D>, D>& a, std::array<std::array<double, 2 * D>, D>& m) {
  for (int j = 0; j < D; ++j) {
    m[j] = {};
    std::copy(a[j].begin(), a[j].end(), m[j].begin());
    m[j][D + j] = 1;
  }
  for (int k = 0; k < D; ++k) {
    int pivot = k;
    for (int j = k + 1; j < D; ++j) {
      pivot = std::abs(m[j][k]) > std::abs(m[pivot][k]) ? j : pivot;
    }
    if (m[pivot][k] == 0) {
      return false;
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
  return true;
}

// Planes divided by the lengths of their normals: a[j] . x = c[j].
template <int D>
struct UnitPlanes {
  std::array<Point<D>, D> a;
  Point<D> c;
  double largest_offset = 0;  // max |c[j]|

  WELLSPACE_INLINE explicit UnitPlanes(const std::array<const Plane<D>*, D>& planes) {
    for (int j = 0; j < D; ++j) {
      for (int i = 0; i < D; ++i) {
        a[j][i] = planes[j]->normal[i] / planes[j]->length;
      }
      c[j] = planes[j]->offset / planes[j]->length;
      largest_offset = std::max(largest_offset, std::abs(c[j]));
    }
  }

  // |A x - c|^2
  WELLSPACE_INLINE double ResidualSq(const Point<D>& x) const {
    double residual_sq = 0;
    for (int j = 0; j < D; ++j) {
      const double r = Dot<D>(a[j], x) - c[j];
      residual_sq += r * r;
    }
    return residual_sq;
  }
};

// The meeting point of D planes by an approximate inverse Y and the residual, D > 3.
//
// Divide each plane by the length of its normal as computed, which is as good a scale as the exact one: A x = c, and
// let A*, c*, x* be the exact ones. The rows of A carry at most 3 u each (difference, quotient; with lengths a few u
// off 1), c at most (D + 6) u |c|, in norm. Let Y be any matrix and F = |Y A - I| in the Frobenius norm, computed with
// an error below (D + 1) u (|Y| |A| + sqrt(D)) < (2 D + 4) u |Y| |A|, |A| = sqrt(D), since sqrt(D) <= |Y| |A| + F; that
// of A* adds 3 u |Y| sqrt(D). If F* <= 1/2 then |A*^-1| <= 2 |Y|. The residual r = A x - c, computed with an error
// below (D + 2) u (|a_j| |x| + |c_j|) in each component, differs from A* x - c* by 3 u |x| + (D + 6) u |c_j| more; so
// |x - x*| <= 2 |Y| (|r| + (2 D + 10) u sqrt(D) (|x| + max |c|)).
template <int D>
Placement<D> Meet(const std::array<const Plane<D>*, D>& planes) requires(D > 3) {
  const UnitPlanes<D> unit(planes);
  std::array<std::array<double, 2 * D>, D> m;  // Y is its right half
  if (!InvertRoughly<D>(unit.a, m)) {
    return {};
  }
  Placement<D> placed;
  double inverse_sq = 0;  // |Y|^2
  double defect_sq = 0;   // F^2
  for (int i = 0; i < D; ++i) {
    placed.x[i] = 0;
    for (int j = 0; j < D; ++j) {
      placed.x[i] += m[i][D + j] * unit.c[j];
      inverse_sq += m[i][D + j] * m[i][D + j];
      double entry = i == j ? -1 : 0;
      for (int k = 0; k < D; ++k) {
        entry += m[i][D + k] * unit.a[k][j];
      }
      defect_sq += entry * entry;
    }
  }
  const double root = std::sqrt(static_cast<double>(D));
  const double inverse_norm = std::sqrt(inverse_sq);
  if (!(std::sqrt(defect_sq) + (2 * D + 8) * kUnit * root * inverse_norm < 0.5)) {
    return placed;
  }
  // One more part in a hundred pays for the roundings of the bound itself.
  placed.radius = std::sqrt(NormSq<D>(placed.x));
  placed.error =
      2.02 * inverse_norm *
      (std::sqrt(unit.ResidualSq(placed.x)) + (2 * D + 10) * kUnit * root * (placed.radius + unit.largest_offset));
  return placed;
}

// A slack is the error of a node, and this share of its distance: so it also bounds the rounding of products x . w, by
// slack |w|.
inline constexpr double kProductError = 16 * kUnit;

// A placed node is wrong by at most this share of its distance from the site. A decision on nodes with twice as much to
// spare does not depend on how they were placed.
inline constexpr double kPlacedError = 0x1p-20;

// Computes where planes of a cell, in their order, meet, exactly where they are too nearly dependent for doubles, and
// returns the slack.
template <int D>
double PlaceByPlanes(const Point<D>& site, const std::array<const Plane<D>*, D>& planes, Point<D>& x) {
  Placement<D> placed = Meet<D>(planes);
  if (std::all_of(planes.begin(), planes.end(),
                  [](const Plane<D>* plane) { return plane->kind != PlaneKind::kBisector; })) {
    placed.error = 0;  // walls are at right angles
  } else if (!(std::isfinite(placed.error) && placed.error <= kPlacedError * placed.radius)) {
    std::array<PlaneSource<D>, D> sources;
    for (int k = 0; k < D; ++k) {
      sources[k] = planes[k]->source;
    }
    placed.x = ExactMeetingPoint<D>(site, sources);
    placed.radius = std::sqrt(NormSq<D>(placed.x));
    placed.error = 8 * kUnit * placed.radius;
  }
  x = placed.x;
  return placed.error + kProductError * placed.radius;
}

// PlaceByPlanes for those of the planes of a cell that have these indices.
template <int D>
double PlaceByPlanes(const Point<D>& site, std::span<const Plane<D>> planes, const std::array<uint16_t, D>& indices,
                     Point<D>& x) {
  std::array<const Plane<D>*, D> own;
  for (int k = 0; k < D; ++k) {
    own[k] = &planes[indices[k]];
  }
  return PlaceByPlanes<D>(site, own, x);
}

// Places `node`, of a cell with these planes, by its own.
template <int D>
void PlaceNode(const Point<D>& site, std::span<const Plane<D>> planes, CellNode<D>& node) {
  node.slack = PlaceByPlanes<D>(site, planes, node.planes, node.x);
  node.radius_sq = NormSq<D>(node.x);
  node.reach = std::sqrt(node.radius_sq) + node.slack;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_MEETING_POINT_H_
