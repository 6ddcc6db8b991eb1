// The balls whose spheres pass through the corners of a facet: which vertices does one of them hold?
#ifndef WELLSPACE_CORE_SIMPLEX_FACET_PENCIL_H_
#define WELLSPACE_CORE_SIMPLEX_FACET_PENCIL_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// A ball with the site on its sphere, its centre relative to the site. The power of a vertex w, relative to the site, is |w|^2 - w .
// twice_centre: negative inside.
template <int D>
struct FacetBall {
  Point<D> twice_centre{};
  double radius = 0;
  double error = 0;  // bounds the distance of the centre from the exact one
  // What the power as computed can be wrong by for a vertex of the ball; outside, it is wrong by less than it is positive and
  // this together. So a power below -doubt says inside, and one of at least doubt outside.
  double doubt = 0;

  // The ball of all points, for a pencil that has no apex yet: every power is below its doubt.
  static FacetBall Everything() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {.twice_centre = {}, .radius = kInfinity, .error = 0, .doubt = kInfinity};
  }
};

// Two or three vertices of a facet, the first of which is the site, and the side of its hyperplane that is the positive one: where
// the site, the others and a point are in positive order, or in negative order if `is_flipped`.
//
// Thread safety: thread-compatible.
template <int D>
class FacetPencil {
  static_assert(D == 2 || D == 3);

 public:
  FacetPencil(const Point<D>& site, const std::array<Point<D>, D - 1>& others, bool is_flipped);

  // Towards the positive side, of the length of the facet's edge, in 3-D twice the facet's area.
  const Point<D>& normal() const { return normal_; }
  // Twice the circumcentre of the facet in its hyperplane, relative to the site, roughly.
  Point<D> TwiceFoot() const;

  // The ball through `apex`.
  //
  // REQUIRES:   apex not in the facet's hyperplane.
  // Complexity: O(1); on nearly flat simplices O(1) on integers of D + 1 times the bits that the coordinates span.
  // Errors:     none.
  // Source:     Cramer's rule.
  FacetBall<D> BallThrough(const Point<D>& apex) const;

  // The side of `u`, exactly.
  Sign SideOf(const Point<D>& u) const;

  // Whether the ball through `apex`, on the positive side, holds `u`; exactly, ties perturbed as cells perturb them.
  //
  // REQUIRES:   the facet is one of the Delaunay triangulation that the perturbation defines; u is neither a vertex of it nor the apex.
  ExactDecision IsInside(const Point<D>& apex, const Point<D>& u) const;

 private:
  // The offset of the centre along the facet, by a vector w across it: see BallThrough.
  Point<D> Turned(const Point<D>& w) const;
  static FacetBall<D> BallAbout(const Point<D>& centre, double error);

  const Point<D> site_;
  const std::array<Point<D>, D - 1> others_;
  const bool is_flipped_;
  std::array<double, 3> moment_;  // 3-D: c_1 w_2 - c_2 w_1; 2-D: c_1 or -c_1, first
  Point<D> normal_;               // towards the positive side, with w . normal_ = det
  double length_product_;         // of the edges at the site
  double half_length_sum_;
};

template <int D>
FacetPencil<D>::FacetPencil(const Point<D>& site, const std::array<Point<D>, D - 1>& others, bool is_flipped)
    : site_(site), others_(others), is_flipped_(is_flipped) {
  const Point<D> a = Difference<D>(others[0], site);
  const double a_sq = NormSq<D>(a);
  if constexpr (D == 2) {
    const double sign = is_flipped ? -1 : 1;
    normal_ = {-a[1] * sign, a[0] * sign};
    moment_ = {0.5 * a_sq * sign, 0, 0};
    length_product_ = std::sqrt(a_sq);
    half_length_sum_ = 0.5 * length_product_;
  } else {
    const Point<D> b = Difference<D>(others[1], site);
    const double b_sq = NormSq<D>(b);
    normal_ = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    for (int i = 0; i < D; ++i) {
      moment_[i] = 0.5 * (a_sq * b[i] - b_sq * a[i]);
    }
    const double a_length = std::sqrt(a_sq);
    const double b_length = std::sqrt(b_sq);
    length_product_ = a_length * b_length;
    half_length_sum_ = 0.5 * (a_length + b_length);
  }
}

template <int D>
Point<D> FacetPencil<D>::Turned(const Point<D>& w) const {
  if constexpr (D == 2) {
    return {moment_[0] * w[1], -moment_[0] * w[0]};
  } else {
    return {moment_[1] * w[2] - moment_[2] * w[1], moment_[2] * w[0] - moment_[0] * w[2],
            moment_[0] * w[1] - moment_[1] * w[0]};
  }
}

template <int D>
Point<D> FacetPencil<D>::TwiceFoot() const {
  const double factor = 2 / NormSq<D>(normal_);
  Point<D> foot = Turned(normal_);
  for (double& x : foot) {
    x *= factor;
  }
  return foot;
}

// The power as computed, for |w| <= 2 r, r the radius: |w|^2 <= 4 r^2 carries D + 2 roundings, each product of w . 2 c one of w and one of
// itself, and D differences follow; the products' absolute values sum up to at most 4 r^2. So it is off by less than 4 (2 D + 2) u r^2 + 4 (D +
// 2) u r^2 <= 52 u r^2, of which 64 u r^2 is more, and by |w| <= 2 r times twice the error of the centre. For |w| = 2 r + x, x > 0, the power
// is at least |w| x, and what may be wrong grows by less than that.
template <int D>
FacetBall<D> FacetPencil<D>::BallAbout(const Point<D>& centre, double error) {
  FacetBall<D> ball;
  ball.radius = std::sqrt(NormSq<D>(centre));
  ball.error = error;
  for (int i = 0; i < D; ++i) {
    ball.twice_centre[i] = 2 * centre[i];
  }
  const double radius = (1 + 0x1p-48) * ball.radius + error;
  ball.doubt = 4 * radius * error + 64 * kUnit * radius * radius;
  return ball;
}

// The centre x solves w_j . x = c_j, c_j = |w_j|^2 / 2, for the others' w_j and that of the apex, w: x = ((c_1 w_2 - c_2 w_1) x w + c (w_1
// x w_2)) / (w . (w_1 x w_2)) in 3-D, and alike in 2-D. With P the product of the lengths |w_j|, |w| and S half their sum, the terms
// of a numerator sum up to at most S P, those of the determinant to sqrt(D) P; each passes through at most 12 roundings (an offset has D + 2,
// a vector one, and five more operations follow). So, where |det| > 256 u P, a coordinate is wrong by at most 18 u (S + |x|) P / |det| with the
// two roundings of the quotient, and x by sqrt(D) < 2 times that; 64 u is used.
template <int D>
FacetBall<D> FacetPencil<D>::BallThrough(const Point<D>& apex) const {
  const Point<D> w = Difference<D>(apex, site_);
  const double w_sq = NormSq<D>(w);
  const double length = std::sqrt(w_sq);
  const double determinant = Dot<D>(w, normal_);
  const double product = length_product_ * length;
  if (!(std::abs(determinant) > 256 * kUnit * product)) {
    std::array<PlaneSource<D>, D> planes;
    for (int j = 0; j < D - 1; ++j) {
      planes[j].generator = others_[j];
    }
    planes[D - 1].generator = apex;
    const Point<D> centre = ExactMeetingPoint<D>(site_, planes);
    return BallAbout(centre, 8 * kUnit * std::sqrt(NormSq<D>(centre)));
  }
  const double inverse = 1 / determinant;
  Point<D> centre = Turned(w);
  for (int i = 0; i < D; ++i) {
    centre[i] = (centre[i] + 0.5 * w_sq * normal_[i]) * inverse;
  }
  const double radius = std::sqrt(NormSq<D>(centre));
  return BallAbout(centre, 64 * kUnit * product * (half_length_sum_ + 0.5 * length + radius) * std::abs(inverse));
}

// The determinant as computed is wrong by less than 14 sqrt(D) u P, P the product of the lengths.
template <int D>
Sign FacetPencil<D>::SideOf(const Point<D>& u) const {
  const Point<D> w = Difference<D>(u, site_);
  const double determinant = Dot<D>(w, normal_);
  const double bound = 32 * kUnit * length_product_ * std::sqrt(NormSq<D>(w));
  if (std::abs(determinant) > bound) {
    return determinant > 0 ? Sign::kPositive : Sign::kNegative;
  }
  Simplex<D> simplex;
  simplex[0] = site_;
  std::copy(others_.begin(), others_.end(), simplex.begin() + 1);
  simplex[D] = u;
  const Sign sign = Orientation<D>(simplex).sign;
  return is_flipped_ ? -sign : sign;
}

template <int D>
ExactDecision FacetPencil<D>::IsInside(const Point<D>& apex, const Point<D>& u) const {
  std::array<PlaneSource<D>, D> planes;
  for (int j = 0; j < D - 1; ++j) {
    planes[j].generator = others_[j];
  }
  planes[D - 1].generator = apex;
  return DecideCut<D>(site_, planes, u, TieRule::kPerturb);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_FACET_PENCIL_H_
