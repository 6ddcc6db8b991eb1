// Triangles in space: their boxes, the boxes that they miss, and their nearest points.
#ifndef WELLSPACE_CORE_GEOMETRY_TRIANGLE_H_
#define WELLSPACE_CORE_GEOMETRY_TRIANGLE_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {

using Triangle = std::array<Point<3>, 3>;

inline Box<3> BoxOfTriangle(const Triangle& triangle) {
  Box<3> box{triangle[0], triangle[0]};
  box.Include({triangle[1], triangle[1]});
  box.Include({triangle[2], triangle[2]});
  return box;
}

// The same triangle, whichever way it goes and whichever corner comes first: results computed of it are then alike to
// the bit.
inline Triangle InOrder(Triangle triangle) {
  std::sort(triangle.begin(), triangle.end());
  return triangle;
}

// A vector across a triangle, twice as long as its area: from where it points, the corners go counterclockwise.
inline Point<3> NormalOf(const Triangle& triangle) {
  return Cross(Difference<3>(triangle[1], triangle[0]), Difference<3>(triangle[2], triangle[0]));
}
inline double AreaOf(const Triangle& triangle) { return 0.5 * std::sqrt(NormSq<3>(NormalOf(triangle))); }

// The circumradius of a triangle with three edges of length 1.
inline constexpr double kRadiusPerEdge = 0.57735026918962573;

// The point at `share` of the way from `a` to `b`; rounded.
inline Point<3> Between(const Point<3>& a, const Point<3>& b, double share) {
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])};
}

// The centroid of a triangle; rounded.
inline Point<3> MiddleOf(const Triangle& triangle) {
  const auto& [a, b, c] = triangle;
  Point<3> middle;
  for (int axis = 0; axis < 3; ++axis) {
    middle[axis] = a[axis] + ((b[axis] - a[axis]) + (c[axis] - a[axis])) / 3;
  }
  return middle;
}

// The longest edge of a triangle: that from corner `k` to the next one; of equal ones the first.
struct LongestEdge {
  size_t k = 0;
  double length_sq = 0;
};
inline LongestEdge LongestEdgeOf(const Triangle& triangle) {
  LongestEdge longest;
  for (size_t k = 0; k < 3; ++k) {
    const double length_sq = DistanceSq<3>(triangle[k], triangle[(k + 1) % 3]);
    longest = length_sq > longest.length_sq ? LongestEdge{k, length_sq} : longest;
  }
  return longest;
}

// Puts the halves of a triangle, cut across its edge from corner `k`, into `pieces`.
inline void Bisect(const Triangle& triangle, size_t k, std::vector<Triangle>& pieces) {
  const Point<3> middle = Between(triangle[k], triangle[(k + 1) % 3], 0.5);
  pieces.push_back(InOrder({triangle[k], middle, triangle[(k + 2) % 3]}));
  pieces.push_back(InOrder({middle, triangle[(k + 1) % 3], triangle[(k + 2) % 3]}));
}

// Whether two closed boxes have no common point; exact.
inline bool AreApart(const Box<3>& a, const Box<3>& b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a.low[axis] > b.high[axis] || a.high[axis] < b.low[axis]) {
      return true;
    }
  }
  return false;
}

// Whether the convex hull of the corners surely has no point in the box, as far as planes across `axis` tell. Seen from
// the middle of the box; `rounding` allows for the differences from there and for the products.
template <size_t kCorners>
inline bool IsParted(const std::array<Point<3>, kCorners>& from_middle, const Point<3>& half, double rounding,
                     const Point<3>& axis) {
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const Point<3>& corner : from_middle) {
    const double at = Dot<3>(axis, corner);
    least = std::min(least, at);
    most = std::max(most, at);
  }
  const double size = std::abs(axis[0]) + std::abs(axis[1]) + std::abs(axis[2]);
  const double reach =
      std::abs(axis[0]) * half[0] + std::abs(axis[1]) * half[1] + std::abs(axis[2]) * half[2] + rounding * size;
  return least > reach || most < -reach;
}

// Half the sides of a box, and the corners of something seen from its middle. `rounding`: by how much a scalar product
// with one of them may be off, for an axis whose coordinates add up to 1.
template <size_t kCorners>
struct SeenFromBox {
  SeenFromBox(const std::array<Point<3>, kCorners>& corners, const Box<3>& box) {
    double size = 0;
    for (int i = 0; i < 3; ++i) {
      const double middle = 0.5 * (box.low[i] + box.high[i]);
      half[i] = 0.5 * (box.high[i] - box.low[i]);
      size = std::max({size, std::abs(box.low[i]), std::abs(box.high[i])});
      for (size_t k = 0; k < kCorners; ++k) {
        from_middle[k][i] = corners[k][i] - middle;
        size = std::max(size, std::abs(corners[k][i]));
      }
    }
    rounding = 0x1p-49 * size;
  }
  bool IsPartedBy(const Point<3>& axis) const { return IsParted(from_middle, half, rounding, axis); }

  std::array<Point<3>, kCorners> from_middle;
  Point<3> half;
  double rounding;
};

// The three vectors across an edge and an axis each.
inline std::array<Point<3>, 3> AcrossAxes(const Point<3>& edge) {
  return {Point<3>{0, -edge[2], edge[1]}, Point<3>{edge[2], 0, -edge[0]}, Point<3>{-edge[1], edge[0], 0}};
}

// Whether the closed triangle surely has no point in the closed box, as far as its own plane and the planes along its
// sides and across it tell: four axes of thirteen. False where rounding leaves a doubt, also of needles, whose planes
// are turned by rounding: each axis is taken as it is, and all corners are looked at.
inline bool SurelyMissesByPlanes(const Triangle& triangle, const Box<3>& box) {
  const SeenFromBox<3> seen(triangle, box);
  const Point<3> normal = NormalOf(triangle);
  if (seen.IsPartedBy(normal)) {
    return true;
  }
  for (size_t k = 0; k < 3; ++k) {
    if (seen.IsPartedBy(Cross(Difference<3>(triangle[(k + 1) % 3], triangle[k]), normal))) {
      return true;
    }
  }
  return false;
}

// Whether the closed triangle surely has no point in the closed box; false where rounding leaves a doubt.
//
// Source:     T. Akenine-Möller, "Fast 3D triangle-box overlap testing", 2001: thirteen axes.
inline bool SurelyMisses(const Triangle& triangle, const Box<3>& box) {
  if (AreApart(BoxOfTriangle(triangle), box)) {
    return true;
  }
  const SeenFromBox<3> seen(triangle, box);
  const std::array<Point<3>, 3> edges = {Difference<3>(triangle[1], triangle[0]),
                                         Difference<3>(triangle[2], triangle[1]),
                                         Difference<3>(triangle[0], triangle[2])};
  if (seen.IsPartedBy(Cross(edges[0], edges[1]))) {
    return true;
  }
  for (const Point<3>& edge : edges) {
    for (const Point<3>& axis : AcrossAxes(edge)) {
      if (seen.IsPartedBy(axis)) {
        return true;
      }
    }
  }
  return false;
}

// SurelyMisses for the segment from `a` to `b`.
inline bool SurelyMisses(const Point<3>& a, const Point<3>& b, const Box<3>& box) {
  Box<3> own{a, a};
  own.Include({b, b});
  if (AreApart(own, box)) {
    return true;
  }
  const SeenFromBox<2> seen({a, b}, box);
  const std::array<Point<3>, 3> axes = AcrossAxes(Difference<3>(b, a));
  return std::any_of(axes.begin(), axes.end(), [&](const Point<3>& axis) { return seen.IsPartedBy(axis); });
}

// The point of a triangle that is nearest to `p`; rounded. Of a triangle that is flat to rounding some point of it that
// is no farther than its corners are.
//
// Source:     C. Ericson, Real-Time Collision Detection, 2005, 5.1.5: by the region of the plane that the foot is in.
inline Point<3> NearestPoint(const Triangle& triangle, const Point<3>& p) {
  const auto [a, b, c] = triangle;
  const auto between = [](const Point<3>& from, const Point<3>& to, double t) {
    return Between(from, to, std::clamp(t, 0.0, 1.0));
  };
  const Point<3> ab = Difference<3>(b, a);
  const Point<3> ac = Difference<3>(c, a);
  const Point<3> ap = Difference<3>(p, a);
  const double d1 = Dot<3>(ab, ap);
  const double d2 = Dot<3>(ac, ap);
  if (d1 <= 0 && d2 <= 0) {
    return a;
  }
  const Point<3> bp = Difference<3>(p, b);
  const double d3 = Dot<3>(ab, bp);
  const double d4 = Dot<3>(ac, bp);
  if (d3 >= 0 && d4 <= d3) {
    return b;
  }
  const double of_c = d1 * d4 - d3 * d2;
  if (of_c <= 0 && d1 >= 0 && d3 <= 0) {
    return between(a, b, d1 / (d1 - d3));
  }
  const Point<3> cp = Difference<3>(p, c);
  const double d5 = Dot<3>(ab, cp);
  const double d6 = Dot<3>(ac, cp);
  if (d6 >= 0 && d5 <= d6) {
    return c;
  }
  const double of_b = d5 * d2 - d1 * d6;
  if (of_b <= 0 && d2 >= 0 && d6 <= 0) {
    return between(a, c, d2 / (d2 - d6));
  }
  const double of_a = d3 * d6 - d5 * d4;
  if (of_a <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return between(b, c, (d4 - d3) / ((d4 - d3) + (d5 - d6)));
  }
  const double sum = of_a + of_b + of_c;
  const double v = of_b / sum;
  const double w = of_c / sum;
  return {a[0] + v * ab[0] + w * ac[0], a[1] + v * ab[1] + w * ac[1], a[2] + v * ab[2] + w * ac[2]};
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_TRIANGLE_H_
