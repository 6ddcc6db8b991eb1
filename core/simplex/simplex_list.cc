#include "core/simplex/simplex_list.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/sort_few.h"
#include "core/geometry/point.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

// A square less than this part of another is clearly smaller: roundings are far below 2^-10 of either, as long as no
// angle of a triangle is tiny (ratio at most 64, so sines of at least 2^-7).
constexpr double kClearly = 1 - 0x1p-10;
constexpr double kMostRatioSq = 64 * 64;
constexpr double kLeastAngleDeg = 0x1p-10;
// A determinant whose square is above this times that of the product of its vectors' lengths is right to 2^-20, and so
// is a circumradius by Cramer's rule.
constexpr double kRightDet = 0x1p-40;

}  // namespace

template <int D>
void SimplexList<D>::Add(const Simplex<D>& points, const std::array<uint32_t, D + 1>& indices) {
  const Glance glance = LookAt(points);
  std::array<uint32_t, D + 1> sorted = indices;
  const bool is_turned = SortFew(sorted);  // each exchange turns the orientation
  const Sign orientation = glance.orientation != Sign::kZero ? glance.orientation : Orientation<D>(points).sign;
  // No branch, since it could not be predicted.
  const uint32_t exchanged =
      (sorted[D - 1] ^ sorted[D]) & -static_cast<uint32_t>(is_turned == (orientation == Sign::kPositive));
  sorted[D - 1] ^= exchanged;
  sorted[D] ^= exchanged;
  indices_.insert(indices_.end(), sorted.begin(), sorted.end());
  if (!glance.is_clearly_better) {
    Measure(points, indices);
  }
}

// In the order of the indices, whichever way the simplex was found.
template <int D>
void SimplexList<D>::Measure(const Simplex<D>& points, const std::array<uint32_t, D + 1>& indices) {
  std::array<int, D + 1> order;
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return indices[a] < indices[b]; });
  Simplex<D> sorted;
  for (int i = 0; i <= D; ++i) {
    sorted[i] = points[order[i]];
  }
  max_radius_edge_ = std::max(max_radius_edge_, RadiusEdgeRatio<D>(sorted));
  better_ratio_sq_ = std::min(kMostRatioSq, kClearly * max_radius_edge_ * max_radius_edge_);
  min_angle_deg_ = std::min(min_angle_deg_, Angles<D>(sorted).min_deg);
  const double tangent = std::tan(min_angle_deg_ * (std::numbers::pi / 180));
  better_cot_sq_ = min_angle_deg_ > kLeastAngleDeg ? kClearly / (tangent * tangent) : 0;
}

template <int D>
typename SimplexList<D>::Glance SimplexList<D>::LookAt(const Simplex<D>& points) const {
  Glance glance;
  if constexpr (D == 2) {
    const Point<2> a = Difference<2>(points[1], points[0]);
    const Point<2> b = Difference<2>(points[2], points[0]);
    const double a_sq = NormSq<2>(a);
    const double b_sq = NormSq<2>(b);
    const double ab_sq = DistanceSq<2>(points[1], points[2]);
    const double det = a[0] * b[1] - a[1] * b[0];
    const double det_sq = det * det;
    if (!(det_sq > kRightDet * a_sq * b_sq)) {
      return glance;
    }
    glance.orientation = det > 0 ? Sign::kPositive : Sign::kNegative;
    // The circumradius is the product of the edges over twice the determinant.
    const double shortest_sq = std::min({a_sq, b_sq, ab_sq});
    glance.is_clearly_better = a_sq * b_sq * ab_sq < better_ratio_sq_ * shortest_sq * 4 * det_sq;
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
    const auto cross = [](const Point<3>& x, const Point<3>& y) {
      return Point<3>{x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
    };
    // All outward, or all inward.
    const Point<3> n_a = cross(b, c);
    const Point<3> n_b = cross(c, a);
    const Point<3> n_c = cross(a, b);
    const Point<3> n_0 = cross(bc, ab);
    const double det = Dot<3>(a, n_a);
    const double det_sq = det * det;
    if (!(det_sq > kRightDet * a_sq * b_sq * c_sq)) {
      return glance;
    }
    glance.orientation = det > 0 ? Sign::kPositive : Sign::kNegative;
    // The circumcentre, relative to the first point, times twice the determinant: Cramer's rule.
    Point<3> centre;
    for (int i = 0; i < 3; ++i) {
      centre[i] = a_sq * n_a[i] + b_sq * n_b[i] + c_sq * n_c[i];
    }
    const double ab_sq = NormSq<3>(ab);
    const double bc_sq = NormSq<3>(bc);
    const double ca_sq = NormSq<3>(ca);
    const double shortest_sq = std::min({a_sq, b_sq, c_sq, ab_sq, bc_sq, ca_sq});
    const double most_sq = better_cot_sq_ * det_sq;
    // No branch, since it could not be predicted.
    const auto is_better = [most_sq](const Point<3>& n, const Point<3>& m, double edge_sq) {
      const double value = Dot<3>(n, m);
      return (value >= 0) | (value * value < most_sq * edge_sq);
    };
    glance.is_clearly_better = (NormSq<3>(centre) < better_ratio_sq_ * shortest_sq * 4 * det_sq) &
                               is_better(n_a, n_b, c_sq) & is_better(n_b, n_c, a_sq) & is_better(n_c, n_a, b_sq) &
                               is_better(n_0, n_a, bc_sq) & is_better(n_0, n_b, ca_sq) & is_better(n_0, n_c, ab_sq);
  }
  return glance;
}

#define WELLSPACE_INSTANTIATE(D) template class SimplexList<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
