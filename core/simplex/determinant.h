// Determinants in doubles of the differences between the corners of a simplex and a point.
#ifndef WELLSPACE_CORE_SIMPLEX_DETERMINANT_H_
#define WELLSPACE_CORE_SIMPLEX_DETERMINANT_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"

namespace wellspace::core {

template <size_t N>
using Rows = std::array<std::array<double, N>, N>;

inline double Determinant(const Rows<2>& m) { return m[0][0] * m[1][1] - m[0][1] * m[1][0]; }
inline double Determinant(const Rows<3>& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}
// By elimination with pivots.
template <size_t N>
double Determinant(Rows<N> m) {
  double determinant = 1;
  for (size_t k = 0; k < N; ++k) {
    size_t pivot = k;
    for (size_t row = k + 1; row < N; ++row) {
      pivot = std::abs(m[row][k]) > std::abs(m[pivot][k]) ? row : pivot;
    }
    if (pivot != k) {
      std::swap(m[k], m[pivot]);
      determinant = -determinant;
    }
    determinant *= m[k][k];
    for (size_t row = k + 1; row < N && m[k][k] != 0; ++row) {
      const double factor = m[row][k] / m[k][k];
      for (size_t axis = k + 1; axis < N; ++axis) {
        m[row][axis] -= factor * m[k][axis];
      }
    }
  }
  return determinant;
}

// A power of two that brings numbers of at most `largest` down to 1/4 to 1/2, as far as it is itself a double: their
// differences, and products of those, are within the range then.
inline double ScaleOf(double largest) {
  const int exponent = std::ilogb(std::max(largest, std::numeric_limits<double>::min()));
  return std::ldexp(1.0, std::clamp(-exponent - 2, -1020, 1020));
}

// `corners` - `x`, scaled by a power of two. Returns the largest number among them, by size.
template <int D>
double Differences(const Simplex<D>& corners, const Point<D>& x, double scale, Simplex<D>* differences) {
  double size = 0;
  for (int i = 0; i <= D; ++i) {
    for (int axis = 0; axis < D; ++axis) {
      (*differences)[i][axis] = corners[i][axis] * scale - x[axis] * scale;
      size = std::max(size, std::abs((*differences)[i][axis]));
    }
  }
  return size;
}

// The volume, times D!, of the simplex that the origin makes with the facet opposite to corner `i` of `corners`. 0 if a
// corner of that facet is the origin.
template <int D>
double CornerVolume(const Simplex<D>& corners, int i) {
  Rows<D> rows;
  for (int k = 0; k < D; ++k) {
    rows[k] = corners[k < i ? k : k + 1];
  }
  // The corner that is left out stands before those that are behind it.
  return i % 2 == 0 ? Determinant(rows) : -Determinant(rows);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_DETERMINANT_H_
