#include "core/simplex/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/dimensions.h"
#include "core/geometry/minors.h"

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

// For MinorsOf: minors in doubles, with their permanents, the same sums over absolute values.
struct Estimate {
  double value = 0;
  double permanent = 0;
};

struct EstimateRing {
  using Entry = double;
  template <int K>
  using Minor = Estimate;

  static Estimate ToMinor(double entry) { return {entry, std::abs(entry)}; }
  static void AddProduct(Estimate& sum, double entry, bool negate, const Estimate& minor) {
    const double term = entry * minor.value;
    sum.value = negate ? sum.value - term : sum.value + term;
    sum.permanent += std::abs(entry) * minor.permanent;
  }
};

// The roundings that a product passes through on the way into a minor of `k` rows: k - 1 products, and up to 1, ..., k
// - 1 sums.
constexpr int MinorRoundings(int k) { return (k - 1) + k * (k - 1) / 2; }

// N / (2 det), the circumcentre relative to p_0, of edges w and their squared lengths; false where rounding could be
// more than 1e-10 of its length.
//
// N_k is the determinant whose column k is |w_i|^2. Each product carries one rounding of each of its D entries (of a
// squared length D + 2 in the place of one) and MinorRoundings(D); so N_k and det differ from the exact values by at
// most K u times their permanents, u = 2^-53, where K = 2 D + 1 + MinorRoundings(D) + 2 has two to spare for second
// order and for the permanents' own roundings. Underflow is below 2^-900. Hence |N| and det have relative errors of at
// most 2^-36 if those bounds are that small beside them, and the quotient one of 2^-35 + 3 u < 1e-10.
template <int D>
bool CircumcentreByMinors(const std::array<Point<D>, D>& w, const std::array<double, D>& lifted, Point<D>& centre) {
  constexpr double kUnits = (2 * D + 1 + MinorRoundings(D) + 2) * 0x1p-53;
  std::array<std::array<double, D>, D + 1> columns;
  for (int i = 0; i < D; ++i) {
    for (int k = 0; k < D; ++k) {
      columns[k][i] = w[i][k];
    }
    columns[D][i] = lifted[i];
  }
  // Without column D, D - 1, ..., 0.
  const std::array<Estimate, D + 1> minors = MinorsOf<EstimateRing, D>(columns);
  const double determinant = minors[0].value;
  double permanent_sq = 0;
  for (int k = 0; k < D; ++k) {
    // The last column has to come to the place of the one left out.
    centre[k] = (D - 1 - k) % 2 == 0 ? minors[D - k].value : -minors[D - k].value;
    permanent_sq += minors[D - k].permanent * minors[D - k].permanent;
  }
  const double error = kUnits * std::sqrt(permanent_sq) + 0x1p-900;
  const double determinant_error = kUnits * minors[0].permanent + 0x1p-900;
  if (!(error <= 0x1p-36 * std::sqrt(NormSq<D>(centre)) && determinant_error <= 0x1p-36 * std::abs(determinant))) {
    return false;
  }
  for (double& x : centre) {
    x /= 2 * determinant;
  }
  return true;
}

// The same in 2-D and 3-D, where the bound is one on the determinant alone. Entries are below 2 and lifted ones below 4
// D, so in 3-D (the worse case) the error of |N| is at most sqrt(3) * 14 u * 3! * 12 * 4 < 7000 u and that of det at
// most 10 u * 3! * 8 = 480 u, u = 2^-53; and |N| = 2 |det| R >= |det|, since R is at least half of an edge of length >=
// 1. The relative error is thus below 7500 u / |det| < 1e-10 as long as |det| >= 2^-6.
constexpr double kWellConditioned = 0x1p-6;

bool CircumcentreByMinors(const std::array<Point<2>, 2>& w, const std::array<double, 2>& lifted, Point<2>& centre) {
  const double determinant = Determinant(w[0], w[1]);
  centre = {lifted[0] * w[1][1] - lifted[1] * w[0][1], w[0][0] * lifted[1] - w[1][0] * lifted[0]};
  for (double& x : centre) {
    x /= 2 * determinant;
  }
  return std::abs(determinant) >= kWellConditioned;
}

bool CircumcentreByMinors(const std::array<Point<3>, 3>& w, const std::array<double, 3>& lifted, Point<3>& centre) {
  const std::array<Point<3>, 3> normals = {Cross(w[1], w[2]), Cross(w[2], w[0]), Cross(w[0], w[1])};
  const double determinant = Dot<3>(w[0], normals[0]);
  for (int k = 0; k < 3; ++k) {
    centre[k] = lifted[0] * normals[0][k] + lifted[1] * normals[1][k] + lifted[2] * normals[2][k];
    centre[k] /= 2 * determinant;
  }
  return std::abs(determinant) >= kWellConditioned;
}

// The circumcentre relative to p_0 times `scale` = ScaleOf(simplex); by exact arithmetic where doubles do not serve.
template <int D>
Point<D> ScaledCircumcentre(const Simplex<D>& simplex, double scale) {
  std::array<Point<D>, D> w;
  std::array<double, D> lifted;
  for (int i = 0; i < D; ++i) {
    w[i] = ScaledEdge<D>(simplex[i + 1], simplex[0], scale);
    lifted[i] = NormSq<D>(w[i]);
  }
  Point<D> centre{};
  bool is_certain = false;
  if constexpr (D <= 3) {
    is_certain = CircumcentreByMinors(w, lifted, centre);
  } else {
    is_certain = CircumcentreByMinors<D>(w, lifted, centre);
  }
  if (!is_certain) {
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

// The vector n with n . x = det(x, edges), by minors.
template <int D>
Point<D> Normal(const std::array<Point<D>, D - 1>& edges) {
  std::array<std::array<double, D - 1>, D> columns;
  for (int i = 0; i < D - 1; ++i) {
    for (int k = 0; k < D; ++k) {
      columns[k][i] = edges[i][k];
    }
  }
  const std::array<Estimate, D> minors = MinorsOf<EstimateRing, D - 1>(columns);  // without column D - 1, ..., 0
  Point<D> normal;
  for (int k = 0; k < D; ++k) {
    normal[k] = k % 2 == 0 ? minors[D - 1 - k].value : -minors[D - 1 - k].value;
  }
  return normal;
}

// Divides by the length, without underflow on the way; false for a vector of zeros.
template <int D>
bool Normalise(Point<D>& vector) {
  double largest = 0;
  for (const double x : vector) {
    largest = std::max(largest, std::abs(x));
  }
  if (largest == 0) {
    return false;
  }
  for (double& x : vector) {
    x /= largest;
  }
  const double length = std::sqrt(NormSq<D>(vector));
  for (double& x : vector) {
    x /= length;
  }
  return true;
}

// In any dimension: the angle between the facets opposite to corners i and j is that of the gradients of their
// barycentric coordinates, 180 degrees less. Multiplied by the determinant, these are normals n_i of the facets.
//
// A component of n_i is a minor of D - 1 rows, wrong by at most K u times its permanent, K = D - 1 + MinorRoundings(D -
// 1) + 2 <= 21 (D = 6); a permanent of n = D - 1 rows is at most n! / n^(n/2) <= 2.2 times the product of their lengths
// (Carlen, Lieb and Loss 2006). So the direction of n_i is wrong by at most sqrt(6) * 21 * 2.2 u / s_i < 114 u / s_i,
// s_i = |n_i| over that product; and an angle by twice that and by the roundings of its sine and cosine, together below
// 300 u / s < 2e-12 / s degrees, s the least of all s_i.
template <int D>
AngleRange AnglesBetweenFacets(const Simplex<D>& p) {
  const double scale = ScaleOf<D>(p);
  std::array<Point<D>, D + 1> normals;
  double determinant = 0;
  for (int i = 0; i <= D; ++i) {
    const int base = i == 0 ? 1 : 0;
    std::array<Point<D>, D - 1> edges;
    for (int corner = 0, to = 0; corner <= D; ++corner) {
      if (corner != i && corner != base) {
        edges[to++] = ScaledEdge<D>(p[corner], p[base], scale);
      }
    }
    normals[i] = Normal<D>(edges);
    // Row i - 1 of det(p_1 - p_0, ..., p_D - p_0) went to the front; with base p_1 the determinant has the other sign.
    if (i == 0 || i % 2 == 0) {
      for (double& x : normals[i]) {
        x = -x;
      }
    }
    if (i == 1) {
      determinant = Dot<D>(normals[1], ScaledEdge<D>(p[1], p[0], scale));
    }
  }
  if (determinant == 0) {
    return {0, 180};
  }
  for (Point<D>& normal : normals) {
    if (!Normalise<D>(normal)) {
      return {0, 180};
    }
  }
  struct Direction {
    double sine = 0;
    double cosine = 0;
    bool IsLessThan(const Direction& other) const {
      const double difference = cosine * other.sine - other.cosine * sine;
      return difference > 0 || (difference == 0 && cosine > other.cosine);
    }
  };
  Direction smallest{0, -1};
  Direction largest{0, 1};
  for (int i = 0; i <= D; ++i) {
    for (int j = i + 1; j <= D; ++j) {
      double sine_sq = 0;
      for (int k = 0; k < D; ++k) {
        for (int l = k + 1; l < D; ++l) {
          const double area = normals[i][k] * normals[j][l] - normals[i][l] * normals[j][k];
          sine_sq += area * area;
        }
      }
      const Direction angle = {std::sqrt(sine_sq), -Dot<D>(normals[i], normals[j])};
      smallest = angle.IsLessThan(smallest) ? angle : smallest;
      largest = largest.IsLessThan(angle) ? angle : largest;
    }
  }
  return {kDegrees * std::atan2(smallest.sine, smallest.cosine), kDegrees * std::atan2(largest.sine, largest.cosine)};
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
  } else if constexpr (D == 3) {
    return AnglesOfTetrahedron(simplex);
  } else {
    return AnglesBetweenFacets<D>(simplex);
  }
}

#define WELLSPACE_INSTANTIATE(D)                              \
  template Point<D> CircumcentreOffset<D>(const Simplex<D>&); \
  template double RadiusEdgeRatio<D>(const Simplex<D>&);      \
  template AngleRange Angles<D>(const Simplex<D>&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
