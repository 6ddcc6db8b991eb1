// Points and vectors of R^D.
#ifndef WELLSPACE_CORE_GEOMETRY_POINT_H_
#define WELLSPACE_CORE_GEOMETRY_POINT_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace wellspace::core {

inline constexpr double kUnit = 0x1p-53;  // relative rounding error of one operation on doubles

template <int D>
using Point = std::array<double, D>;

// Row `index` of points, n x D, row-major.
template <int D>
inline Point<D> PointAt(std::span<const double> points, size_t index) {
  Point<D> p;
  std::copy_n(points.begin() + static_cast<std::ptrdiff_t>(index * D), D, p.begin());
  return p;
}

template <int D>
inline Point<D> Difference(const Point<D>& a, const Point<D>& b) {
  Point<D> out;
  for (int i = 0; i < D; ++i) {
    out[i] = a[i] - b[i];
  }
  return out;
}

template <int D>
inline double Dot(const Point<D>& a, const Point<D>& b) {
  double sum = a[0] * b[0];
  for (int i = 1; i < D; ++i) {
    sum += a[i] * b[i];
  }
  return sum;
}

template <int D>
inline double NormSq(const Point<D>& a) {
  return Dot<D>(a, a);
}

template <int D>
inline double DistanceSq(const Point<D>& a, const Point<D>& b) {
  return NormSq<D>(Difference<D>(a, b));
}

// |a - b|, without overflow or underflow on the way.
template <int D>
inline double Distance(const Point<D>& a, const Point<D>& b) {
  Point<D> difference = Difference<D>(a, b);
  double largest = 0;
  for (const double x : difference) {
    largest = std::max(largest, std::abs(x));
  }
  if (largest == 0 || !std::isfinite(largest)) {
    return largest;
  }
  const int exponent = std::ilogb(largest);
  for (double& x : difference) {
    x = std::scalbn(x, -exponent);
  }
  return std::scalbn(std::sqrt(NormSq<D>(difference)), exponent);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_POINT_H_
