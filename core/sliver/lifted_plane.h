// The side of a simplex's sphere that a point is on, for many points: terms of the simplex alone are computed once.
#ifndef WELLSPACE_CORE_SLIVER_LIFTED_PLANE_H_
#define WELLSPACE_CORE_SLIVER_LIFTED_PLANE_H_

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/exact_measure.h"
#include "core/geometry/minors.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The hyperplane through the corners of a simplex lifted to (p, |p|^2 - W), relative to its first corner, in doubles.
//
// The lifted point q is above it by det(e_i, l_i; q, l) / det(e_i): the determinant's rows are those of corners and q,
// its last expanded by the cofactors that are kept here.
template <int D>
class LiftedPlane {
 public:
  LiftedPlane() = default;

  // REQUIRES: corners positively oriented; no weight above a quarter of the squared distance to another vertex.
  LiftedPlane(const Simplex<D>& corners, const std::array<double, D + 1>& weights)
      : origin_(corners[0]), origin_weight_(weights[0]) {
    std::array<std::array<double, D>, D + 1> columns;
    double largest = 0;
    for (int i = 0; i < D; ++i) {
      const Point<D> e = Difference<D>(corners[i + 1], origin_);
      for (int k = 0; k < D; ++k) {
        columns[k][i] = e[k];
        largest = std::max(largest, std::abs(e[k]));
      }
      columns[D][i] = NormSq<D>(e) - weights[i + 1] + origin_weight_;
    }
    // Minor k is without column D - k.
    const auto minors = MinorsOf<DoubleRing, D>(columns);
    for (int k = 0; k < D; ++k) {
      cofactors_[k] = (D - k) % 2 == 0 ? -minors[D - k] : minors[D - k];
    }
    cofactors_[D] = -minors[0];
    largest_ = largest;
    bound_ = BoundOf(largest);
  }

  // The plane of the simplex with `origin` and its weight, whose cofactors have been computed; `largest`: no coordinate
  // of an edge is larger.
  LiftedPlane(const Point<D>& origin, double origin_weight, const std::array<double, D + 1>& cofactors, double largest)
      : origin_(origin),
        cofactors_(cofactors),
        origin_weight_(origin_weight),
        largest_(largest),
        bound_(BoundOf(largest)) {}

  // SideOf is certain beyond this times the square of the largest coordinate of an edge, or of q.
  static double BoundOf(double largest) {
    double bound = kFilterBound;
    for (int i = 0; i < D; ++i) {
      bound *= largest;
    }
    return bound;
  }

  // Positive if a vertex at `p` is certainly in conflict with the simplex, negative if it is certainly not, zero in
  // doubt.
  //
  // REQUIRES:   weight at most a quarter of the squared distance to the corners.
  // Complexity: O(D).
  int SideOf(const Point<D>& p, double weight) const {
    const Point<D> q = Difference<D>(p, origin_);
    double value = cofactors_[D] * (NormSq<D>(q) - weight + origin_weight_);
    double largest = largest_;
    for (int i = 0; i < D; ++i) {
      value += cofactors_[i] * q[i];
      largest = std::max(largest, std::abs(q[i]));
    }
    const double bound = bound_ * largest * largest;
    return static_cast<int>(value > bound) - static_cast<int>(value < -bound);
  }

 private:
  // Doubles for MinorsOf.
  struct DoubleRing {
    using Entry = double;
    template <int K>
    using Minor = double;
    static double ToMinor(double entry) { return entry; }
    static void AddProduct(double& sum, double factor, bool negate, double minor) {
      sum += negate ? -factor * minor : factor * minor;
    }
  };

  static constexpr int Factorial(int n) { return n <= 1 ? 1 : n * Factorial(n - 1); }

  // The sign of the determinant is certain beyond this times m^D n^2, m the largest coordinate of an edge from the
  // first corner, and n that or the largest of q. Weights are at most D m^2 and D n^2, so that the terms of a lifted
  // entry add up to three times as much; each of the (D + 1)! products passes through at most 7 (D + 1) roundings: D of
  // them expand the minors' rows by one product and D - 1 sums, D + 4 make a lifted entry, one any other.
  static constexpr double kFilterBound = Factorial(D + 1) * 3.0 * D * 7 * (D + 1) * 0x1p-53;

  Point<D> origin_{};
  std::array<double, D + 1> cofactors_{};
  double origin_weight_ = 0;
  double largest_ = 0;
  double bound_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_LIFTED_PLANE_H_
