// In which solid a point lies, decided by a look at all triangles: the first below it.
#ifndef WELLSPACE_TESTS_CORE_TREE_SOLID_ORACLE_H_
#define WELLSPACE_TESTS_CORE_TREE_SOLID_ORACLE_H_

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/geometry/exact_measure.h"

namespace wellspace::test {

// Points are moved by (e, e^2, e^3) for an e above zero and smaller than any number. Of the triangles above which the
// moved point is in the projection along the third axis, it is the highest one below the point that bounds its solid.
//
// Thread safety: thread-safe.
class SolidOracle {
 public:
  SolidOracle(const core::SurfaceComplex& complex, const core::Solids& solids) : complex_(complex), solids_(solids) {}

  uint32_t SolidAt(const core::Point<3>& p) const {
    std::optional<uint32_t> highest;
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      if (IsBelow(t, p) && (!highest.has_value() || IsHigher(t, *highest, p))) {
        highest = t;
      }
    }
    return highest.has_value() ? solids_.solid_of[core::HalfFacetOf(*highest, Turn(*highest) < 0)] : 0;
  }

 private:
  using Rational = boost::multiprecision::cpp_rational;

  static core::Point<2> Flat(const core::Point<3>& p) { return {p[0], p[1]}; }
  static int Compared(double x, double y) { return x < y ? -1 : x > y ? 1 : 0; }
  static int Of(const core::MeasuredSign& measured) { return static_cast<int>(measured.sign); }

  // Above 0 if its corners are counterclockwise from above, 0 if it is upright.
  int Turn(uint32_t t) const {
    return Of(
        core::Orientation<2>({Flat(complex_.Corner(t, 0)), Flat(complex_.Corner(t, 1)), Flat(complex_.Corner(t, 2))}));
  }

  // Whether the moved point is left of the way from a to b in the projection.
  static int Left(const core::Point<3>& a, const core::Point<3>& b, const core::Point<3>& p) {
    const int side = Of(core::Orientation<2>({Flat(a), Flat(b), Flat(p)}));
    const int by_first = Compared(a[1], b[1]);
    return side != 0 ? side : by_first != 0 ? by_first : Compared(b[0], a[0]);
  }

  bool IsBelow(uint32_t t, const core::Point<3>& p) const {
    const core::Point<3>& a = complex_.Corner(t, 0);
    const core::Point<3>& b = complex_.Corner(t, 1);
    const core::Point<3>& c = complex_.Corner(t, 2);
    const int first = Left(a, b, p);
    if (Left(b, c, p) != first || Left(c, a, p) != first) {
      return false;
    }
    const int turn = Turn(t);
    if (turn == 0) {
      return false;
    }
    int side = Of(core::Orientation<3>({a, b, c, p}));
    for (size_t axis = 0; side == 0 && axis < 3; ++axis) {
      const auto flat = [&](const core::Point<3>& x) { return core::Point<2>{x[(axis + 1) % 3], x[(axis + 2) % 3]}; };
      side = Of(core::Orientation<2>({flat(a), flat(b), flat(c)}));
    }
    return side == turn;
  }

  // The height of the plane over the point, and how it grows as that moves along the first axis and the second.
  std::array<Rational, 3> HeightAt(uint32_t t, const core::Point<3>& p) const {
    std::array<std::array<Rational, 3>, 3> v;
    for (size_t i = 0; i < 3; ++i) {
      v[0][i] = Rational(complex_.Corner(t, 1)[i]) - Rational(complex_.Corner(t, 0)[i]);
      v[1][i] = Rational(complex_.Corner(t, 2)[i]) - Rational(complex_.Corner(t, 0)[i]);
      v[2][i] = Rational(p[i]) - Rational(complex_.Corner(t, 0)[i]);
    }
    const Rational determinant = v[0][0] * v[1][1] - v[0][1] * v[1][0];
    const Rational by_first = (v[0][2] * v[1][1] - v[0][1] * v[1][2]) / determinant;
    const Rational by_second = (v[0][0] * v[1][2] - v[0][2] * v[1][0]) / determinant;
    return {Rational(complex_.Corner(t, 0)[2]) + by_first * v[2][0] + by_second * v[2][1], by_first, by_second};
  }

  bool IsHigher(uint32_t t, uint32_t u, const core::Point<3>& p) const {
    const auto low = [&](uint32_t i) {
      return std::min({complex_.Corner(i, 0)[2], complex_.Corner(i, 1)[2], complex_.Corner(i, 2)[2]});
    };
    const auto high = [&](uint32_t i) {
      return std::max({complex_.Corner(i, 0)[2], complex_.Corner(i, 1)[2], complex_.Corner(i, 2)[2]});
    };
    if (low(t) > high(u) || low(u) > high(t)) {
      return low(t) > high(u);
    }
    return HeightAt(t, p) > HeightAt(u, p);
  }

  const core::SurfaceComplex& complex_;
  const core::Solids& solids_;
};

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_TREE_SOLID_ORACLE_H_
