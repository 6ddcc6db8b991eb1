// The vertices that may cut a cell in the plane or in space: picked eight at a time, and sorted by distance. From 4-D
// on candidates.h does so. For cell_on_unit.h, into whose functions all is compiled.
#ifndef WELLSPACE_CORE_CELL_FLOAT_CANDIDATES_H_
#define WELLSPACE_CORE_CELL_FLOAT_CANDIDATES_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/base/ids.h"
#include "core/base/simd/float_lanes.h"
#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"
#include "core/cell/cell_parts.h"
#include "core/cell/float_bisector.h"
#include "core/cell/float_errors.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The vertices that may cut a cell, in columns; whole vectors are written, the last one perhaps from the last one on.
template <int D>
struct alignas(sizeof(Floats)) FloatCandidates {
  static constexpr size_t kMost = kMostCutTogether;
  static constexpr size_t kCapacity = kMost + kFloatLanes;

  // As of FloatBisector, by candidate.
  float w[D][kCapacity];
  float offset[kCapacity];
  float least_offset[kCapacity];
  int32_t slot[kCapacity];  // among the positions
  size_t count = 0;
  uint32_t order[kCapacity];  // from the nearest on, but for distances that agree to one part in 2^17
  size_t within_reach = 0;    // but for the site

  // Picks those of `vertices` but `site_name` that are near enough to cut a cell about `site` of that radius, and that
  // `may_cut` leaves: given the vectors to eight, their least offsets, and which of them are near, it drops from the
  // last those that miss the cell. Then finds the order.
  template <VectorUnit kUnit, typename Vertices, typename MayCut>
  WELLSPACE_INLINE void Pick(const Vertices& vertices, VertexId site_name, const Point<D>& site, double scale,
                             float radius_bound, MayCut may_cut) {
    const Floats far = Splat(OffsetBound<D>(radius_bound));
    const FloatMask end = Splat(static_cast<int32_t>(vertices.size()));
    const float error = kExcessError<D> * radius_bound;
    FloatMask slots = kEachLane;
    for (size_t from = 0; from < vertices.size(); from += kFloatLanes) {
      Floats vectors[D];
      vertices.FindVectors(from, site, scale, vectors);
      Floats length_sq = vectors[0] * vectors[0];
      for (int axis = 1; axis < D; ++axis) {
        length_sq += vectors[axis] * vectors[axis];
      }
      Floats length;
      for (size_t lane = 0; lane < kFloatLanes; ++lane) {
        length[lane] = __builtin_sqrtf(length_sq[lane]);
      }
      // As FloatBisector::Of.
      const Floats offsets = 0.5f * length_sq;
      const Floats least_offsets = offsets - (error * length + kUnderflow);
      FloatMask is_near = IsAtMost<kUnit>(offsets, far) & IsLess<kUnit>(slots, end);
      is_near &= ~vertices.template AreNamed<kUnit>(site_name, from);
      within_reach += static_cast<size_t>(std::popcount(Bits<kUnit>(is_near)));
      may_cut(vectors, least_offsets, is_near);
      // The candidates that are left are appended to each column, by one shuffle that moves them to the front.
      const uint32_t kept = Bits<kUnit>(is_near);
      const FloatMask lanes = OrderOf<kUnit>(kept);
      const auto append = [&](const auto& items, auto* column) __attribute__((always_inline)) {
        const auto chosen = WELLSPACE_SHUFFLE(items, lanes);
        std::memcpy(column + count, &chosen, sizeof(chosen));
      };
      for (int axis = 0; axis < D; ++axis) {
        append(vectors[axis], w[axis]);
      }
      append(offsets, offset);
      append(least_offsets, least_offset);
      append(slots, slot);
      count += static_cast<size_t>(std::popcount(kept));
      slots += static_cast<int32_t>(kFloatLanes);
    }
    order[0] = 0;
    if (count > 1) {
      FindOrder<kUnit>();
    }
  }

  // Calls cut(bisector, slot), which tells whether anything is cut off, from the nearest on, as long as they are within
  // `offset_bound`(), which may have changed then.
  template <typename Cut, typename Most>
  WELLSPACE_INLINE void CutInOrder(Cut cut, Most offset_bound) const {
    float left = std::numeric_limits<float>::infinity();
    for (size_t j = 0; j < count; ++j) {
      const uint32_t i = order[j];
      FloatBisector<D> bisector;
      for (int axis = 0; axis < D; ++axis) {
        bisector.w[axis] = w[axis][i];
      }
      bisector.offset = offset[i];
      bisector.least_offset = least_offset[i];
      if (bisector.offset > left) {
        break;
      }
      if (cut(bisector, static_cast<size_t>(slot[i]))) {
        left = offset_bound() * (1 + 0x1p-16f);  // later candidates may be nearer by as much
      }
    }
  }

 private:
  // Finds the place of each by counting those before it.
  template <VectorUnit kUnit>
  WELLSPACE_INLINE void FindOrder() {
    constexpr int kNumberBits = 6;
    static_assert(kMost <= size_t{1} << kNumberBits);
    alignas(sizeof(FloatMask)) int32_t keys[kCapacity];
    // The bits of a float that is not negative order as it does; numbered in the last ones, no two are equal.
    FloatMask number = kEachLane;
    for (size_t first = 0; first < count; first += kFloatLanes) {
      FloatMask own = *reinterpret_cast<const FloatMask*>(offset + first);
      own = (own >> kNumberBits << kNumberBits) | number;
      own = Choose<kUnit>(IsLess<kUnit>(number, Splat(static_cast<int32_t>(count))), own,
                          Splat(std::numeric_limits<int32_t>::max()));
      *reinterpret_cast<FloatMask*>(keys + first) = own;
      number += static_cast<int32_t>(kFloatLanes);
    }
    for (size_t first = 0; first < count; first += kFloatLanes) {
      const FloatMask own = *reinterpret_cast<const FloatMask*>(keys + first);
      FloatMask before{};
      for (size_t i = 0; i < count; i += kFloatLanes) {
        for (size_t k = i; k < i + kFloatLanes; ++k) {
          before -= IsLess<kUnit>(Splat(keys[k]), own);
        }
      }
      for (size_t lane = 0; lane < kFloatLanes; ++lane) {
        order[before[lane]] = static_cast<uint32_t>(first + lane);  // lanes without a candidate: after the last
      }
    }
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_CANDIDATES_H_
