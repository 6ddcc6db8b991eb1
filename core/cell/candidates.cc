#include "core/cell/candidates.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "core/base/dimensions.h"
#include "core/base/simd/lane_bits.h"

namespace wellspace::core {
namespace {

// Up to so many candidates are ranked by comparing each with each: as many as the lower bits of a key can number.
constexpr int kNumberBits = 6;
constexpr size_t kMostRanked = size_t{1} << kNumberBits;

// The halves of the lanes of a vector that are kept, in order.
struct alignas(kLanes * sizeof(double)) Order {
  int32_t halves[8];
};

// By the bits of the lanes that are kept.
constexpr std::array<Order, 16> kOrders = [] {
  std::array<Order, 16> orders{};
  for (uint32_t bits = 0; bits < 16; ++bits) {
    int next = 0;
    for (int lane = 0; lane < 4; ++lane) {
      if ((bits >> lane & 1) != 0) {
        orders[bits].halves[next++] = 2 * lane;
        orders[bits].halves[next++] = 2 * lane + 1;
      }
    }
  }
  return orders;
}();

// Writes the lanes of `wide` whose bit in `kept` is set to `column`, from `at` on, in order. Later values there are
// lost.
template <size_t kWidth>
WELLSPACE_INLINE void Compress(const typename Wide<kWidth>::Mask& wide, uint32_t kept, void* column, size_t at) {
  auto* const to = static_cast<int64_t*>(column) + at;
  if constexpr (kWidth == 4) {
    using Halves = Wide<4>::Halves;
    const auto order = *reinterpret_cast<const Halves*>(kOrders[kept].halves);
    const Halves compressed = WELLSPACE_SHUFFLE(reinterpret_cast<const Halves&>(wide), order);
    std::memcpy(to, &compressed, sizeof(compressed));
  } else {
    // Both, then the second again, over the first unless that is kept.
    const int64_t second = wide[1];
    std::memcpy(to, &wide, sizeof(wide));
    std::memcpy(to + (kept & 1), &second, sizeof(second));
  }
}

// A bit for each lane of the vector that begins where `left` items are left.
template <size_t kWidth>
uint32_t BitsOfItems(size_t left) {
  return (1u << std::min(left, kWidth)) - 1;
}

// Candidates::Pick: a vector of positions at a time, of which Compress keeps those within the limit, in every column.
template <int D, size_t kWidth>
WELLSPACE_INLINE void PickThose(std::span<const Point<D>> positions, const Point<D>& site, double limit_sq,
                                Candidates<D>& out) {
  static_assert(LeafTree<D>::VertexPool::kTogether % kWidth == 0);
  using Lanes = typename Wide<kWidth>::Lanes;
  using Mask = typename Wide<kWidth>::Mask;
  Mask slot{};
  for (size_t lane = 0; lane < kWidth; ++lane) {
    slot[lane] = static_cast<int64_t>(lane);
  }
  size_t count = 0;
  for (size_t from = 0; from < positions.size(); from += kWidth) {
    Lanes w[D];
    const Point<D>* const p = &positions[from];
    Lanes length_sq{};
    Mask is_other{};
    for (int axis = 0; axis < D; ++axis) {
      if constexpr (kWidth == 4) {
        w[axis] = Lanes{p[0][axis], p[1][axis], p[2][axis], p[3][axis]} - site[axis];
      } else {
        w[axis] = Lanes{p[0][axis], p[1][axis]} - site[axis];
      }
      length_sq = axis == 0 ? w[axis] * w[axis] : length_sq + w[axis] * w[axis];
      is_other |= w[axis] != 0;
    }
    const uint32_t kept =
        Bits<kWidth>(is_other & (length_sq <= limit_sq)) & BitsOfItems<kWidth>(positions.size() - from);
    for (int axis = 0; axis < D; ++axis) {
      Compress<kWidth>(reinterpret_cast<const Mask&>(w[axis]), kept, out.w[axis], count);
    }
    Compress<kWidth>(reinterpret_cast<const Mask&>(length_sq), kept, out.length_sq, count);
    Compress<kWidth>(slot, kept, out.slot, count);
    slot += static_cast<int64_t>(kWidth);
    count += static_cast<size_t>(std::popcount(kept));
  }
  out.count = count;
}

// Candidates::DropThoseThatMiss: every column is compressed in place.
template <int D, size_t kWidth>
WELLSPACE_INLINE void DropThose(size_t begin, Candidates<D>& all) {
  using Mask = typename Wide<kWidth>::Mask;
  const size_t first = begin / kWidth * kWidth;  // lanes before begin stay
  uint32_t done = (1u << (begin - first)) - 1;
  size_t count = first;
  for (size_t from = first; from < all.count; from += kWidth) {
    const uint32_t kept =
        (Bits<kWidth>(LanesAt<kWidth>(all.excess_bound, from) >= 0) | done) & BitsOfItems<kWidth>(all.count - from);
    const auto compress = [&](auto* column) __attribute__((always_inline)) {
      Compress<kWidth>(*reinterpret_cast<const Mask*>(column + from), kept, column, count);
    };
    for (int axis = 0; axis < D; ++axis) {
      compress(all.w[axis]);
    }
    compress(all.length_sq);
    compress(all.slot);
    count += static_cast<size_t>(std::popcount(kept));
    done = 0;
  }
  all.count = count;
}

// Moves candidate i to the place `places[i]`. By four, since the end of the loop is predicted better then: lanes
// without a candidate have the place after the last.
template <int D>
WELLSPACE_INLINE void Scatter(const Candidates<D>& from, const uint32_t* places, Candidates<D>& to) {
  for (size_t first = 0; first < from.count; first += kLanes) {
    for (size_t i = first; i < first + kLanes; ++i) {
      const size_t place = places[i];
      for (int axis = 0; axis < D; ++axis) {
        to.w[axis][place] = from.w[axis][i];
      }
      to.length_sq[place] = from.length_sq[i];
      to.slot[place] = from.slot[i];
    }
  }
}

// The place of each is the number of those before it: all are compared with all, by keys of 32 bits that are made of
// squares and numbers. Loops over whole vectors: their ends are predicted better.
template <int D, size_t kWidth>
WELLSPACE_INLINE void SortByRank(const Candidates<D>& from, Candidates<D>& to) {
  constexpr size_t kItems = 2 * kWidth;
  using Keys = typename Wide<kWidth>::Halves;
  static_assert(LeafTree<D>::kLeafCapacity % kItems == 0 && std::endian::native == std::endian::little);
  // The upper half of a square, which orders as the whole does, numbered in its last bits: no two are equal.
  alignas(kLanes * sizeof(double)) std::array<int32_t, kMostRanked> keys;
  alignas(kLanes * sizeof(double)) std::array<uint32_t, kMostRanked> places;
  Keys number{};
  for (size_t i = 0; i < kItems; ++i) {
    number[i] = static_cast<int32_t>(i);
  }
  for (size_t first = 0; first < from.count; first += kItems) {
    const Keys low = *reinterpret_cast<const Keys*>(from.length_sq + first);
    const Keys high = *reinterpret_cast<const Keys*>(from.length_sq + first + kWidth);
    Keys own;
    if constexpr (kWidth == 4) {
      own = WELLSPACE_SHUFFLE(low, high, Keys{1, 3, 5, 7, 9, 11, 13, 15});
    } else {
      own = WELLSPACE_SHUFFLE(low, high, Keys{1, 3, 5, 7});
    }
    own = (own >> kNumberBits << kNumberBits) | number;
    own = number < static_cast<int32_t>(from.count) ? own : Keys{} + std::numeric_limits<int32_t>::max();
    *reinterpret_cast<Keys*>(&keys[first]) = own;
    number += static_cast<int32_t>(kItems);
  }
  for (size_t first = 0; first < from.count; first += kItems) {
    const Keys own = *reinterpret_cast<const Keys*>(&keys[first]);
    Keys before{};
    for (size_t i = 0; i < from.count; i += kItems) {
      for (size_t k = i; k < i + kItems; ++k) {
        before -= keys[k] < own;
      }
    }
    *reinterpret_cast<Keys*>(&places[first]) = before;
  }
  Scatter<D>(from, places.data(), to);
}

template <int D>
WELLSPACE_AVX2 void PickAvx2(std::span<const Point<D>> positions, const Point<D>& site, double limit_sq,
                             Candidates<D>& out) {
  PickThose<D, 4>(positions, site, limit_sq, out);
}
template <int D>
WELLSPACE_AVX2 void DropAvx2(size_t begin, Candidates<D>& all) {
  DropThose<D, 4>(begin, all);
}
template <int D>
WELLSPACE_AVX2 void SortByRankAvx2(const Candidates<D>& from, Candidates<D>& to) {
  SortByRank<D, 4>(from, to);
}

// For more than kMostRanked, of a leaf as full as from 5-D on.
template <int D>
void SortByComparing(const Candidates<D>& from, Candidates<D>& to) {
  std::array<uint32_t, Candidates<D>::kCapacity> order;
  std::array<uint32_t, Candidates<D>::kCapacity> places;
  for (uint32_t i = 0; i < from.count; ++i) {
    order[i] = i;
  }
  std::sort(order.begin(), order.begin() + from.count, [&](uint32_t a, uint32_t b) {
    return from.length_sq[a] != from.length_sq[b] ? from.length_sq[a] < from.length_sq[b] : a < b;
  });
  for (uint32_t i = 0; i < from.count; ++i) {
    places[order[i]] = i;
  }
  std::fill(places.begin() + from.count, places.begin() + PaddedCount(from.count), static_cast<uint32_t>(from.count));
  Scatter<D>(from, places.data(), to);
}

}  // namespace

template <int D>
void Candidates<D>::Pick(std::span<const Point<D>> positions, const Point<D>& site, double limit_sq, VectorUnit unit) {
  unit == VectorUnit::kAvx2 ? PickAvx2<D>(positions, site, limit_sq, *this)
                            : PickThose<D, 2>(positions, site, limit_sq, *this);
}

template <int D>
void Candidates<D>::DropThoseThatMiss(size_t begin, VectorUnit unit) {
  unit == VectorUnit::kAvx2 ? DropAvx2<D>(begin, *this) : DropThose<D, 2>(begin, *this);
}

template <int D>
void Candidates<D>::Sort(const Candidates& from, VectorUnit unit) {
  count = from.count;
  if (count > kMostRanked) {
    SortByComparing<D>(from, *this);
  } else {
    unit == VectorUnit::kAvx2 ? SortByRankAvx2<D>(from, *this) : SortByRank<D, 2>(from, *this);
  }
}

#define WELLSPACE_INSTANTIATE(D) template struct Candidates<D>;
WELLSPACE_FOR_EACH_DIMENSION_ABOVE_3(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
