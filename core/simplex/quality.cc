#include "core/simplex/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace wellspace::core {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

// A factor 2^k that brings the largest coordinate of p_i - p_0 into [1, 2), as far as 2^k itself can be represented.
template <int D>
double ScaleOf(const Simplex<D>& simplex) {
  double largest = 0;
  for (int i = 1; i <= D; ++i) {
    for (int k = 0; k < D; ++k) {
      largest = std::max(largest, std::abs(simplex[i][k] - simplex[0][k]));
    }
  }
  return largest > 0 ? std::scalbn(1.0, std::min(-std::ilogb(largest), 1000)) : 1.0;
}

// (a - b) * scale: one rounding.
template <int D>
Point<D> ScaledEdge(const Point<D>& a, const Point<D>& b, double scale) {
  Point<D> out = Difference<D>(a, b);
  for (double& x : out) {
    x *= scale;
  }
  return out;
}

Point<3> Cross(const Point<3>& a, const Point<3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double Determinant(const Point<2>& a, const Point<2>& b) { return a[0] * b[1] - a[1] * b[0]; }

// The circumcentre relative to p_0 times `scale` = ScaleOf(simplex).
//
// In doubles the centre is N / (2 det), N_k the determinant whose column k is |w_i|^2. Entries are below 2 and lifted
// ones below 4 D, so in 3-D (the worse case) the error of |N| is at most sqrt(3) * 14 u * 3! * 12 * 4 < 7000 u and that
// of det at most 10 u * 3! * 8 = 480 u, u = 2^-53; and |N| = 2 |det| R >= |det|, since R is at least half of an edge of
// length >= 1. The relative error is thus below 7500 u / |det| < 1e-10 as long as |det| >= 2^-6. The exact stage takes
// the others.
template <int D>
Point<D> ScaledCircumcentre(const Simplex<D>& simplex, double scale) {
  constexpr double kWellConditioned = 0x1p-6;
  std::array<Point<D>, D> w;
  std::array<double, D> lifted;
  for (int i = 0; i < D; ++i) {
    w[i] = ScaledEdge<D>(simplex[i + 1], simplex[0], scale);
    lifted[i] = NormSq<D>(w[i]);
  }
  Point<D> centre{};
  double determinant = 0;
  if constexpr (D == 2) {
    determinant = Determinant(w[0], w[1]);
    centre = {lifted[0] * w[1][1] - lifted[1] * w[0][1], w[0][0] * lifted[1] - w[1][0] * lifted[0]};
  } else {
    const std::array<Point<3>, 3> normals = {Cross(w[1], w[2]), Cross(w[2], w[0]), Cross(w[0], w[1])};
    determinant = Dot<3>(w[0], normals[0]);
    for (int k = 0; k < 3; ++k) {
      centre[k] = lifted[0] * normals[0][k] + lifted[1] * normals[1][k] + lifted[2] * normals[2][k];
    }
  }
  if (std::abs(determinant) >= kWellConditioned) {
    for (double& x : centre) {
      x /= 2 * determinant;
    }
  } else {
    centre = ExactCircumcentreOffset<D>(simplex);
    for (double& x : centre) {
      x *= scale;
    }
  }
  return centre;
}

AngleRange AnglesOfTriangle(const Simplex<2>& p) {
  const double scale = ScaleOf<2>(p);
  const std::array<Point<2>, 3> edges = {ScaledEdge<2>(p[2], p[1], scale), ScaledEdge<2>(p[0], p[2], scale),
                                         ScaledEdge<2>(p[1], p[0], scale)};
  const double twice_area = std::abs(Determinant(edges[1], edges[2]));
  if (twice_area == 0) {
    return {0, 180};
  }
  // tan(angle between two edges) = twice_area / (their product), so the order of the products is that of the angles.
  double largest_dot = -std::numeric_limits<double>::infinity();
  double smallest_dot = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double dot = -Dot<2>(edges[(i + 1) % 3], edges[(i + 2) % 3]);
    largest_dot = std::max(largest_dot, dot);
    smallest_dot = std::min(smallest_dot, dot);
  }
  return {kDegrees * std::atan2(twice_area, largest_dot), kDegrees * std::atan2(twice_area, smallest_dot)};
}

AngleRange AnglesOfTetrahedron(const Simplex<3>& p) {
  // kFaces[i] is the face opposite to corner i, outward for a positive orientation.
  constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  const double scale = ScaleOf<3>(p);
  std::array<Point<3>, 4> normals;
  for (int i = 0; i < 4; ++i) {
    const auto& [a, b, c] = kFaces[i];
    normals[i] = Cross(ScaledEdge<3>(p[b], p[a], scale), ScaledEdge<3>(p[c], p[a], scale));
  }
  const double six_volumes = std::abs(Dot<3>(normals[0], ScaledEdge<3>(p[0], p[1], scale)));
  if (six_volumes == 0) {
    return {0, 180};
  }
  // |n_i x n_j| is six volumes times the length of the common edge, so the angle's cotangent is -(n_i . n_j) / (length
  // * six_volumes).
  double largest = -std::numeric_limits<double>::infinity();
  double smallest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      const int k = i != 0 ? 0 : j != 1 ? 1 : 2;
      const int l = 6 - i - j - k;
      const double length = std::sqrt(NormSq<3>(ScaledEdge<3>(p[k], p[l], scale)));
      const double value = -Dot<3>(normals[i], normals[j]) / length;
      largest = std::max(largest, value);
      smallest = std::min(smallest, value);
    }
  }
  return {kDegrees * std::atan2(six_volumes, largest), kDegrees * std::atan2(six_volumes, smallest)};
}

}  // namespace

template <int D>
Point<D> CircumcentreOffset(const Simplex<D>& simplex) {
  const double scale = ScaleOf<D>(simplex);
  Point<D> centre = ScaledCircumcentre<D>(simplex, scale);
  for (double& x : centre) {
    x /= scale;
  }
  return centre;
}

template <int D>
double RadiusEdgeRatio(const Simplex<D>& simplex) {
  const double scale = ScaleOf<D>(simplex);
  const double radius_sq = NormSq<D>(ScaledCircumcentre<D>(simplex, scale));
  double shortest_sq = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= D; ++i) {
    for (int j = i + 1; j <= D; ++j) {
      shortest_sq = std::min(shortest_sq, NormSq<D>(ScaledEdge<D>(simplex[i], simplex[j], scale)));
    }
  }
  return std::sqrt(radius_sq) / std::sqrt(shortest_sq);
}

template <int D>
AngleRange Angles(const Simplex<D>& simplex) {
  if constexpr (D == 2) {
    return AnglesOfTriangle(simplex);
  } else {
    return AnglesOfTetrahedron(simplex);
  }
}

template Point<2> CircumcentreOffset<2>(const Simplex<2>&);
template Point<3> CircumcentreOffset<3>(const Simplex<3>&);
template double RadiusEdgeRatio<2>(const Simplex<2>&);
template double RadiusEdgeRatio<3>(const Simplex<3>&);
template AngleRange Angles<2>(const Simplex<2>&);
template AngleRange Angles<3>(const Simplex<3>&);

}  // namespace wellspace::core
