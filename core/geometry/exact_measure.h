// Exact orientation, in-sphere test, volume and circumcentre of simplices, for the validators of a mesh.
//
// Independent of power_predicate on purpose: which simplices there are is decided by other arithmetic than the
// validators'. (They share the orientation alone, with which a mesher tells the two sides of a facet.)
#ifndef WELLSPACE_CORE_GEOMETRY_EXACT_MEASURE_H_
#define WELLSPACE_CORE_GEOMETRY_EXACT_MEASURE_H_

#include <array>
#include <memory>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// The corners of a simplex.
template <int D>
using Simplex = std::array<Point<D>, D + 1>;

// An exact sign, and which stage found it: kFilter or kBigInteger.
struct MeasuredSign {
  Sign sign = Sign::kZero;
  Stage stage = Stage::kBigInteger;
};

// The sign of det(p_1 - p_0, ..., p_D - p_0): kPositive when the corners are in counter-clockwise (right-handed) order.
//
// Laws:       (1) kZero iff the corners lie in one hyperplane; (2) exchanging two corners negates it.
// REQUIRES:   finite coordinates.
// Complexity: O(D 2^D) operations in doubles; on doubt as many on integers of D times the bits that the coordinates
//             span.
// Errors:     none.
template <int D>
MeasuredSign Orientation(const Simplex<D>& simplex);

// On which side of the circumsphere of `simplex` is `q`: kPositive strictly inside, kZero on it, kNegative outside; the
// other way round for a simplex of negative orientation.
//
// Laws:       (1) kZero iff q is on the sphere, or the simplex is flat and q in its hyperplane; (2) exchanging two
//             corners negates it; (3) exchanging q and a corner negates it.
// REQUIRES:   finite coordinates.
// Complexity: O(D 2^D) operations in doubles; on doubt as many on integers of D + 2 times the bits that the coordinates
//             span.
// Errors:     none.
template <int D>
MeasuredSign InSphere(const Simplex<D>& simplex, const Point<D>& q);

// The same for weighted vertices: whether the power of `q`, |q - c|^2 - r^2 - W_q, to the sphere (c, r) that is
// orthogonal to the corners is negative (kPositive: q has to be joined to them), zero or positive.
//
// Laws:       as InSphere, which it is when all weights are equal.
// REQUIRES:   finite coordinates and weights.
// Complexity: as InSphere.
// Errors:     none.
template <int D>
MeasuredSign InPowerSphere(const Simplex<D>& simplex, const std::array<double, D + 1>& weights, const Point<D>& q,
                           double q_weight);

// circumcentre - p_0, each coordinate within a relative error of 2^-50 of the exact value; infinities for a flat
// simplex.
//
// REQUIRES:   finite coordinates.
// Complexity: O(D^2 2^D) operations on integers of D + 1 times the bits that the coordinates span.
// Errors:     none.
template <int D>
Point<D> ExactCircumcentreOffset(const Simplex<D>& simplex);

// A sum of signed volumes of simplices and boxes, without any rounding.
//
// Thread safety: thread-compatible.
// Invariants: the value is an integer times a power of two; its size grows with the bits that the coordinates span, not
// with the terms.
template <int D>
class ExactVolumeSum {
 public:
  ExactVolumeSum();
  ~ExactVolumeSum();
  ExactVolumeSum(const ExactVolumeSum&) = delete;
  ExactVolumeSum& operator=(const ExactVolumeSum&) = delete;

  // REQUIRES:   finite coordinates.
  // Complexity: O(D 2^D) operations on integers of D times the bits that the coordinates span.
  // Errors:     none.
  void Add(const Simplex<D>& simplex);
  void Subtract(const Box<D>& box);

  Sign sign() const;
  // The sum, rounded; infinite where it is beyond the range of doubles.
  double value() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_EXACT_MEASURE_H_
