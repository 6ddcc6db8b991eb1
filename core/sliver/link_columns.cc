#include "core/sliver/link_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/simd/lane_bits.h"
#include "core/sliver/lifted_plane.h"
#include "core/sliver/tetrahedron.h"

// Vectors that are passed and returned never are: all that does so is compiled into its callers.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace wellspace::core {
namespace {

// Neighbours are told apart by the bits of a word.
constexpr uint32_t kMostNeighbours = 64;
// A neighbour that is less far beyond a facet, by the size of all, is left to the exact decision.
constexpr double kLeastHeight = 1e-10;

}  // namespace

void LinkColumns::Clear() {
  groups_.clear();
  count_ = 0;
  largest_ = 0;
}

void LinkColumns::Add(const Point<3>& e, double weight) {
  const size_t lane = count_ % kLanes;
  if (lane == 0) {
    Group& group = groups_.emplace_back();
    std::fill(&group.x[0][0], &group.x[0][0] + 4 * kLanes, std::numeric_limits<double>::quiet_NaN());
  }
  for (int axis = 0; axis < 3; ++axis) {
    groups_.back().x[axis][lane] = e[axis];
    largest_ = std::max(largest_, 2 * std::abs(e[axis]));
  }
  groups_.back().x[3][lane] = NormSq<3>(e) - weight;
  ++count_;
}

// The neighbour that is the least far beyond a facet: of those more than `least` above it, by the distance of the
// sphere's centre from `centre`, half of which is that of the facet's circle.
template <size_t kWidth>
WELLSPACE_INLINE uint32_t LinkColumns::NearestBeyond(const std::array<double, 4>& origin, const Point<3>& normal,
                                                     const Point<3>& centre, double least) const {
  using Lanes = typename Wide<kWidth>::Lanes;
  Lanes nearest = Lanes{} + std::numeric_limits<double>::infinity();
  Lanes nearest_at = {};
  Lanes number = {};
  for (size_t lane = 0; lane < kWidth; ++lane) {
    number[lane] = static_cast<double>(lane);
  }
  for (const Group& group : groups_) {
    for (size_t from = 0; from < kLanes; from += kWidth) {
      const auto [x, y, z, lift] = group.template RelativeTo<kWidth>(origin, from);
      const Lanes height = x * normal[0] + y * normal[1] + z * normal[2];
      const Lanes far = (lift - (x * centre[0] + y * centre[1] + z * centre[2])) / height;
      const auto is_nearer = (height > least) & (far < nearest);
      nearest = is_nearer ? far : nearest;
      nearest_at = is_nearer ? number : nearest_at;
      number += static_cast<double>(kWidth);
    }
  }
  size_t best = 0;
  for (size_t lane = 1; lane < kWidth; ++lane) {
    best = nearest[lane] < nearest[best] ? lane : best;
  }
  return static_cast<uint32_t>(nearest_at[best]);
}

// A bit for each neighbour for which the function of these cofactors is not surely below `bound`.
template <size_t kWidth>
WELLSPACE_INLINE uint64_t LinkColumns::NotSurelyOutside(const std::array<double, 4>& origin,
                                                        const std::array<double, 4>& cofactors, double bound) const {
  using Lanes = typename Wide<kWidth>::Lanes;
  uint64_t in_doubt = 0;
  size_t at_bit = 0;
  for (const Group& group : groups_) {
    for (size_t from = 0; from < kLanes; from += kWidth) {
      const auto [x, y, z, lift] = group.template RelativeTo<kWidth>(origin, from);
      const Lanes value = x * cofactors[0] + y * cofactors[1] + z * cofactors[2] + lift * cofactors[3];
      in_doubt |= uint64_t{Bits<kWidth>(value >= bound)} << at_bit;
      at_bit += kWidth;
    }
  }
  return in_doubt;
}

template <size_t kWidth>
WELLSPACE_INLINE std::optional<LinkColumns::Tetrahedron> LinkColumns::WrapWith(uint32_t a, uint32_t b,
                                                                               uint32_t c) const {
  if (count_ > kMostNeighbours) {
    return std::nullopt;
  }
  const std::array<double, 4> lifted_origin = {at(a, 0), at(a, 1), at(a, 2), at(a, 3)};
  const Point<3> origin = {lifted_origin[0], lifted_origin[1], lifted_origin[2]};
  const double origin_lift = lifted_origin[3];
  const auto edge_to = [&](uint32_t u) { return Difference<3>({at(u, 0), at(u, 1), at(u, 2)}, origin); };
  const Point<3> edge_b = edge_to(b);
  const Point<3> edge_c = edge_to(c);
  const double lift_b = at(b, 3) - origin_lift;
  const double lift_c = at(c, 3) - origin_lift;
  const Point<3> normal = Cross(edge_b, edge_c);
  // Twice the centre of the facet's circle.
  const double normal_sq = NormSq<3>(normal);
  const Point<3> by_b = Cross(edge_c, normal);
  const Point<3> by_c = Cross(normal, edge_b);
  Point<3> centre;
  for (int i = 0; i < 3; ++i) {
    centre[i] = (lift_b * by_b[i] + lift_c * by_c[i]) / normal_sq;
  }
  const double least = kLeastHeight * std::sqrt(normal_sq) * largest_;

  const uint32_t apex = NearestBeyond<kWidth>(lifted_origin, normal, centre, least);

  // Whether all others are surely outside. Edges here have two roundings, and lifts one more than LiftedPlane counts
  // with, but no term of a lift is more than half as large as there; so its bound holds.
  const Point<3> edge_apex = edge_to(apex);
  const double lift_apex = at(apex, 3) - origin_lift;
  const Point<3> by_apex_c = Cross(edge_c, edge_apex);
  const Point<3> by_apex_b = Cross(edge_apex, edge_b);
  std::array<double, 4> cofactors;
  for (int i = 0; i < 3; ++i) {
    cofactors[i] = lift_b * by_apex_c[i] + lift_c * by_apex_b[i] + lift_apex * normal[i];
  }
  cofactors[3] = -Dot<3>(edge_apex, normal);
  const double bound = LiftedPlane<3>::BoundOf(largest_);
  if (!(cofactors[3] < -bound)) {
    return std::nullopt;
  }
  const uint64_t in_doubt = NotSurelyOutside<kWidth>(lifted_origin, cofactors, -bound * largest_ * largest_);
  const uint64_t own = uint64_t{1} << a | uint64_t{1} << b | uint64_t{1} << c | uint64_t{1} << apex;
  if ((in_doubt & ~own) != 0) {
    return std::nullopt;
  }
  // Relative to the first vertex, not to the vertex that has been taken out.
  for (int i = 0; i < 3; ++i) {
    cofactors[i] += 2 * cofactors[3] * origin[i];
  }
  return Tetrahedron{apex, cofactors, largest_};
}

WELLSPACE_AVX2 std::optional<LinkColumns::Tetrahedron> LinkColumns::WrapAvx2(uint32_t a, uint32_t b, uint32_t c) const {
  return WrapWith<4>(a, b, c);
}

std::optional<LinkColumns::Tetrahedron> LinkColumns::Wrap(uint32_t a, uint32_t b, uint32_t c, VectorUnit unit) const {
  return unit == VectorUnit::kAvx2 ? WrapAvx2(a, b, c) : WrapWith<2>(a, b, c);
}

}  // namespace wellspace::core
