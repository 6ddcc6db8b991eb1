#include "core/voronoi/nearness.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace wellspace::core {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Up to so many, items are ranked by comparing each with each.
constexpr size_t kMostRanked = 64;

// The place of each is the number of those before it.
template <size_t kWidth>
WELLSPACE_INLINE void Rank(const double* distances, size_t count, uint32_t* order) {
  using Lanes = typename Wide<kWidth>::Lanes;
  using Mask = typename Wide<kWidth>::Mask;
  for (size_t from = 0; from < count; from += kWidth) {
    const Lanes own = LanesAt<kWidth>(distances, from);
    Mask before{};  // minus their number
    for (size_t i = 0; i < from; ++i) {
      before += distances[i] + Lanes{} <= own;
    }
    for (size_t i = from; i < count; ++i) {
      before += distances[i] + Lanes{} < own;
    }
    // Equal ones among these.
    for (size_t lane = 1; lane < kWidth; ++lane) {
      for (size_t i = 0; i < lane; ++i) {
        before[lane] -= own[i] == own[lane] ? 1 : 0;
      }
    }
    for (size_t lane = 0; lane < kWidth && from + lane < count; ++lane) {
      order[static_cast<size_t>(-before[lane])] = static_cast<uint32_t>(from + lane);
    }
  }
}

WELLSPACE_AVX2 void RankAvx2(const double* distances, size_t count, uint32_t* order) {
  Rank<4>(distances, count, order);
}

}  // namespace

void OrderByDistance(double* distances, size_t count, uint32_t* order, VectorUnit unit) {
  if (count <= 1) {
    order[0] = 0;
  } else if (count <= kMostRanked) {
    std::fill(distances + count, distances + PaddedCount(count), kInfinity);
    unit == VectorUnit::kAvx2 ? RankAvx2(distances, count, order) : Rank<2>(distances, count, order);
  } else {
    std::iota(order, order + count, 0);
    std::stable_sort(order, order + count, [&](uint32_t a, uint32_t b) { return distances[a] < distances[b]; });
  }
}

}  // namespace wellspace::core
