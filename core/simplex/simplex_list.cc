#include "core/simplex/simplex_list.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/base/dimensions.h"
#include "core/geometry/point.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

// A square less than this part of another is clearly smaller: roundings are far below 2^-10 of either, as long as no angle of a triangle
// is tiny (ratio at most 64, so sines of at least 2^-7).
constexpr double kClearly = 1 - 0x1p-10;
constexpr double kMostRatioSq = 64 * 64;
constexpr double kLeastAngleDeg = 0x1p-10;

}  // namespace

template <int D>
void SimplexList<D>::Add(const Simplex<D>& points, const std::array<uint32_t, D + 1>& indices, double radius_sq) {
  // By insertion; each exchange turns the orientation.
  Simplex<D> sorted_points = points;
  std::array<uint32_t, D + 1> sorted = indices;
  bool is_positive = true;
  for (int i = 1; i <= D; ++i) {
    for (int j = i; j > 0 && sorted[j - 1] > sorted[j]; --j) {
      std::swap(sorted[j - 1], sorted[j]);
      std::swap(sorted_points[j - 1], sorted_points[j]);
      is_positive = !is_positive;
    }
  }
  if (!is_positive) {
    std::swap(sorted[D - 1], sorted[D]);
  }
  indices_.insert(indices_.end(), sorted.begin(), sorted.end());
  if (!IsClearlyBetter(points, radius_sq)) {
    // Measured in the order of the indices, whichever way the simplex was found.
    max_radius_edge_ = std::max(max_radius_edge_, RadiusEdgeRatio<D>(sorted_points));
    better_ratio_sq_ = std::min(kMostRatioSq, kClearly * max_radius_edge_ * max_radius_edge_);
    min_angle_deg_ = std::min(min_angle_deg_, Angles<D>(sorted_points).min_deg);
    const double tangent = std::tan(min_angle_deg_ * (std::numbers::pi / 180));
    better_cot_sq_ = min_angle_deg_ > kLeastAngleDeg ? kClearly / (tangent * tangent) : 0;
  }
}

template <int D>
bool SimplexList<D>::IsClearlyBetter(const Simplex<D>& points, double radius_sq) const {
  if constexpr (D == 2) {
    double shortest_sq = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      shortest_sq = std::min(shortest_sq, DistanceSq<2>(points[i], points[(i + 1) % 3]));
    }
    return radius_sq < better_ratio_sq_ * shortest_sq;
  } else if constexpr (D == 3) {
    const Point<3> a = Difference<3>(points[1], points[0]);
    const Point<3> b = Difference<3>(points[2], points[0]);
    const Point<3> c = Difference<3>(points[3], points[0]);
    const Point<3> ab = Difference<3>(b, a);
    const Point<3> bc = Difference<3>(c, b);
    const Point<3> ca = Difference<3>(a, c);
    const double a_sq = NormSq<3>(a);
    const double b_sq = NormSq<3>(b);
    const double c_sq = NormSq<3>(c);
    const double ab_sq = NormSq<3>(ab);
    const double bc_sq = NormSq<3>(bc);
    const double ca_sq = NormSq<3>(ca);
    const double shortest_sq = std::min({a_sq, b_sq, c_sq, ab_sq, bc_sq, ca_sq});
    if (!(radius_sq < better_ratio_sq_ * shortest_sq)) {
      return false;
    }
    const auto cross = [](const Point<3>& x, const Point<3>& y) {
      return Point<3>{x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
    };
    // All outward, or all inward.
    const Point<3> n_a = cross(b, c);
    const Point<3> n_b = cross(c, a);
    const Point<3> n_c = cross(a, b);
    const Point<3> n_0 = cross(bc, ab);
    const double volume = Dot<3>(a, n_a);
    const double most_sq = better_cot_sq_ * volume * volume;
    const auto is_better = [most_sq](const Point<3>& n, const Point<3>& m, double edge_sq) {
      const double value = Dot<3>(n, m);
      return value >= 0 || value * value < most_sq * edge_sq;
    };
    return is_better(n_a, n_b, c_sq) && is_better(n_b, n_c, a_sq) && is_better(n_c, n_a, b_sq) &&
           is_better(n_0, n_a, bc_sq) && is_better(n_0, n_b, ca_sq) && is_better(n_0, n_c, ab_sq);
  } else {
    return false;
  }
}

#define WELLSPACE_INSTANTIATE(D) template class SimplexList<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
