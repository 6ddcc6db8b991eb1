// Inputs of DecideCut for the tests of its laws and of its stages.
#ifndef WELLSPACE_TESTS_CORE_GEOMETRY_DECIDED_POINTS_H_
#define WELLSPACE_TESTS_CORE_GEOMETRY_DECIDED_POINTS_H_

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"
#include "tests/support/clouds.h"

namespace wellspace::core {

template <int D>
using Planes = std::array<PlaneSource<D>, D>;

// A site, the generators of D bisectors, and u.
template <int D>
using Decided = std::array<Point<D>, D + 2>;

template <int D>
Planes<D> BisectorsOf(const Decided<D>& p) {
  Planes<D> planes;
  for (int j = 0; j < D; ++j) {
    planes[j].generator = p[j + 1];
  }
  return planes;
}

template <int D>
ExactDecision Decide(const Decided<D>& p, TieRule rule) {
  return DecideCut<D>(p[0], BisectorsOf<D>(p), p[D + 1], rule);
}

template <int D>
Simplex<D> SimplexOf(const Decided<D>& p) {
  Simplex<D> simplex;
  std::copy_n(p.begin(), D + 1, simplex.begin());
  return simplex;
}

template <int D>
bool AreDistinct(Decided<D> p) {
  std::sort(p.begin(), p.end());
  return std::adjacent_find(p.begin(), p.end()) == p.end();
}

// Whether DecideCut's REQUIRES hold for any choice of a site.
template <int D>
bool IsDecidable(const Decided<D>& p) {
  return AreDistinct<D>(p) && Orientation<D>(SimplexOf<D>(p)).sign != Sign::kZero;
}

// The node is the circumcentre of the site and the generators: u cuts it off where it is inside their sphere.
template <int D>
Sign SignByInSphere(const Decided<D>& p) {
  return InSphere<D>(SimplexOf<D>(p), p[D + 1]).sign * Orientation<D>(SimplexOf<D>(p)).sign;
}

template <int D>
Decided<D> Scaled(Decided<D> p, double factor) {
  for (Point<D>& point : p) {
    for (double& x : point) {
      x *= factor;
    }
  }
  return p;
}

template <int D>
Decided<D> Translated(Decided<D> p, const Point<D>& by) {
  for (Point<D>& point : p) {
    for (int k = 0; k < D; ++k) {
      point[k] += by[k];
    }
  }
  return p;
}

// The inputs that the properties are checked on.
enum class Inputs { kSmallGrid, kLargeGrid, kUniform, kOneUlpApart, kLogUniform };
inline constexpr std::array kAllInputs = {Inputs::kSmallGrid, Inputs::kLargeGrid, Inputs::kUniform,
                                          Inputs::kOneUlpApart, Inputs::kLogUniform};

inline double DrawCoordinate(Inputs inputs, test::SplitMix64& random) {
  switch (inputs) {
    case Inputs::kSmallGrid:
      return static_cast<double>(random.Below(3));
    case Inputs::kLargeGrid:
      return static_cast<double>(random.Below(2000)) - 1000;
    case Inputs::kUniform:
      return random.Unit() - 0.25;
    case Inputs::kOneUlpApart:
      return 1 + static_cast<double>(random.Below(4)) * 0x1p-52;
    case Inputs::kLogUniform:
      return std::ldexp(random.Unit() - 0.5, -static_cast<int>(random.Below(250)));
  }
  return 0;
}

template <int D>
Decided<D> Draw(Inputs inputs, test::SplitMix64& random) {
  while (true) {
    Decided<D> p;
    for (Point<D>& point : p) {
      for (double& x : point) {
        x = DrawCoordinate(inputs, random);
      }
    }
    if (IsDecidable<D>(p)) {
      return p;
    }
  }
}

// D + 2 corners of a cube: cospherical, and any D + 1 that are not in a plane do for a simplex.
template <int D>
Decided<D> DrawCubeCorners(test::SplitMix64& random) {
  while (true) {
    Decided<D> p;
    const double side = static_cast<double>(1 + random.Below(8));
    for (Point<D>& point : p) {
      for (double& x : point) {
        x = random.Below(2) == 0 ? 0 : side;
      }
    }
    if (IsDecidable<D>(p)) {
      return p;
    }
  }
}

}  // namespace wellspace::core

#endif  // WELLSPACE_TESTS_CORE_GEOMETRY_DECIDED_POINTS_H_
