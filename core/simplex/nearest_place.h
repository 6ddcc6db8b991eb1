// The point of a simplex that is nearest to a point beside it.
#ifndef WELLSPACE_CORE_SIMPLEX_NEAREST_PLACE_H_
#define WELLSPACE_CORE_SIMPLEX_NEAREST_PLACE_H_

#include <array>

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A place in a simplex, and how far away it is.
template <int D>
struct NearestPlace {
  double distance_sq = 0;                   // in scaled units
  std::array<double, D + 1> coordinates{};  // barycentric: at least 0, with a sum of 1 but for rounding
};

// The place on the facets of the simplex that is nearest to `x`. `scale` is a power of two by which all coordinates are
// multiplied, so that squares of their differences are within the range of doubles.
//
// REQUIRES:   finite coordinates.
// Complexity: O(2^D D^3).
template <int D>
NearestPlace<D> NearestIn(const Simplex<D>& corners, const Point<D>& x, double scale);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_NEAREST_PLACE_H_
