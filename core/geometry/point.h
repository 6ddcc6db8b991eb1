// Points and vectors of R^D.
#ifndef WELLSPACE_CORE_GEOMETRY_POINT_H_
#define WELLSPACE_CORE_GEOMETRY_POINT_H_

#include <array>

namespace wellspace::core {

template <int D>
using Point = std::array<double, D>;

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

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_POINT_H_
