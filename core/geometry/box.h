// Axis-aligned boxes and the names of their faces.
#ifndef WELLSPACE_CORE_GEOMETRY_BOX_H_
#define WELLSPACE_CORE_GEOMETRY_BOX_H_

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/geometry/point.h"

namespace wellspace::core {

// A set of faces of a box: bit 2 i is the low face of axis i, bit 2 i + 1 the high one.
using FaceMask = uint16_t;

constexpr int FaceIndex(int axis, bool high) { return 2 * axis + (high ? 1 : 0); }

// The faces that meet in a corner of a box; bit i of `corner` says high on axis i.
template <int D>
constexpr FaceMask CornerFaces(int corner) {
  FaceMask mask = 0;
  for (int i = 0; i < D; ++i) {
    mask = static_cast<FaceMask>(mask | (1u << FaceIndex(i, ((corner >> i) & 1) != 0)));
  }
  return mask;
}

template <int D>
struct Box {
  Point<D> low;
  Point<D> high;

  bool operator==(const Box&) const = default;

  // The coordinate that all points of face `face` share.
  double FaceCoordinate(int face) const { return face % 2 == 0 ? low[face / 2] : high[face / 2]; }

  // Distance from `p`, a point of the box, to the plane of `face`.
  double DistanceToFace(const Point<D>& p, int face) const { return std::abs(FaceCoordinate(face) - p[face / 2]); }

  bool Contains(const Point<D>& p) const {
    for (int i = 0; i < D; ++i) {
      if (!(p[i] >= low[i] && p[i] <= high[i])) {
        return false;
      }
    }
    return true;
  }

  // Grows until it holds `other`.
  void Include(const Box& other) {
    for (int i = 0; i < D; ++i) {
      low[i] = std::min(low[i], other.low[i]);
      high[i] = std::max(high[i], other.high[i]);
    }
  }

  double LongestSide() const {
    double longest = 0;
    for (int i = 0; i < D; ++i) {
      longest = std::max(longest, high[i] - low[i]);
    }
    return longest;
  }

  double ShortestSide() const {
    double shortest = high[0] - low[0];
    for (int i = 1; i < D; ++i) {
      shortest = std::min(shortest, high[i] - low[i]);
    }
    return shortest;
  }

  // The faces that `p` lies on.
  FaceMask FacesOf(const Point<D>& p) const {
    FaceMask mask = 0;
    for (int face = 0; face < 2 * D; ++face) {
      if (p[face / 2] == FaceCoordinate(face)) {
        mask |= static_cast<FaceMask>(1u << face);
      }
    }
    return mask;
  }
};

template <int D>
Box<D> CubeAround(const Point<D>& centre, double half_side) {
  Box<D> cube{centre, centre};
  for (int i = 0; i < D; ++i) {
    cube.low[i] -= half_side;
    cube.high[i] += half_side;
  }
  return cube;
}

// The square of x where that is positive, else 0; no branch, since it could not be predicted.
inline double PositivePartSq(double x) {
  const double twice = x + std::abs(x);
  return 0.25 * twice * twice;
}

// The squared distance between a point and a box.
template <int D>
inline double DistanceSq(const Point<D>& p, const Box<D>& box) {
  double sum = 0;
  for (int i = 0; i < D; ++i) {
    sum += PositivePartSq(std::max(box.low[i] - p[i], p[i] - box.high[i]));
  }
  return sum;
}

// The squared distance between two boxes.
template <int D>
inline double DistanceSq(const Box<D>& a, const Box<D>& b) {
  double sum = 0;
  for (int i = 0; i < D; ++i) {
    sum += PositivePartSq(std::max(a.low[i] - b.high[i], b.low[i] - a.high[i]));
  }
  return sum;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_BOX_H_
