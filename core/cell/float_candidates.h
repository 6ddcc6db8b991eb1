// What cells in the plane and in space are cut by, eight vertices at a time. For gathered_vertices.cc, polygon.cc and
// polyhedron.cc alone, into which all is compiled.
#ifndef WELLSPACE_CORE_CELL_FLOAT_CANDIDATES_H_
#define WELLSPACE_CORE_CELL_FLOAT_CANDIDATES_H_

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>

#include "core/base/ids.h"
#include "core/base/simd/float_lanes.h"
#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"
#include "core/cell/cell_parts.h"
#include "core/cell/float_bisector.h"
#include "core/cell/float_errors.h"
#include "core/cell/gathered_vertices.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Vectors from `site` to eight positions, times `scale`.
WELLSPACE_INLINE void VectorsTo(const Point<2>* positions, const Point<2>& site, double scale, Floats* w) {
  using Four = Wide<4>::Lanes;
  using FourFloats = float __attribute__((vector_size(16)));
  const Four from = {site[0], site[1], site[0], site[1]};
  FourFloats pairs[4];  // x, y, x, y
  for (size_t k = 0; k < 4; ++k) {
    Four two;
    std::memcpy(&two, positions + 2 * k, sizeof(two));
    pairs[k] = __builtin_convertvector((two - from) * scale, FourFloats);
  }
  const Floats even = __builtin_shufflevector(pairs[0], pairs[2], 0, 1, 2, 3, 4, 5, 6, 7);
  const Floats odd = __builtin_shufflevector(pairs[1], pairs[3], 0, 1, 2, 3, 4, 5, 6, 7);
  w[0] = WELLSPACE_SHUFFLE(even, odd, FloatMask{0, 2, 8, 10, 4, 6, 12, 14});
  w[1] = WELLSPACE_SHUFFLE(even, odd, FloatMask{1, 3, 9, 11, 5, 7, 13, 15});
}
// The same to the positions that at(0) to at(7) give.
template <int D, typename At>
WELLSPACE_INLINE void VectorsToEach(At at, const Point<D>& site, double scale, Floats* w) {
  using Four = Wide<4>::Lanes;
  using FourFloats = float __attribute__((vector_size(16)));
  const Point<D>* const p[kFloatLanes] = {&at(0), &at(1), &at(2), &at(3), &at(4), &at(5), &at(6), &at(7)};
  for (int axis = 0; axis < D; ++axis) {
    const Four low = Four{(*p[0])[axis], (*p[1])[axis], (*p[2])[axis], (*p[3])[axis]} - site[axis];
    const Four high = Four{(*p[4])[axis], (*p[5])[axis], (*p[6])[axis], (*p[7])[axis]} - site[axis];
    w[axis] = __builtin_shufflevector(__builtin_convertvector(low * scale, FourFloats),
                                      __builtin_convertvector(high * scale, FourFloats), 0, 1, 2, 3, 4, 5, 6, 7);
  }
}
WELLSPACE_INLINE void VectorsTo(const Point<3>* positions, const Point<3>& site, double scale, Floats* w) {
  VectorsToEach<3>(
      [positions](size_t i) __attribute__((always_inline))->const Point<3>& { return positions[i]; }, site, scale, w);
}

// Vertices that lie side by side. May be read as those of a leaf may (VertexPool::kReadTogether).
template <int D>
struct VerticesTogether {
  std::span<const Point<D>> positions;
  const VertexNames& names;

  size_t size() const { return positions.size(); }
  const Point<D>& position(size_t i) const { return positions[i]; }
  VertexId name(size_t i) const { return names[i]; }
  // To eight from the i-th on.
  WELLSPACE_INLINE void FindVectors(size_t i, const Point<D>& site, double scale, Floats* w) const {
    VectorsTo(&positions[i], site, scale, w);
  }
  // Which of them are called that.
  template <VectorUnit kUnit>
  WELLSPACE_INLINE FloatMask AreCalled(VertexId name, size_t i) const {
    FloatMask listed{};
    if (names.listed != nullptr) {
      std::memcpy(&listed, names.listed + i, sizeof(listed));
      listed = IsEqual<kUnit>(listed, Splat(static_cast<int32_t>(Index(name))));
    }
    return listed;
  }
};

// Some of those that have been gathered, by number; beyond the last there are seven more numbers of any.
template <int D>
struct VerticesChosen {
  const GatheredVertices<D>& gathered;
  std::span<const int32_t> numbers;

  size_t size() const { return numbers.size(); }
  const Point<D>& position(size_t i) const { return gathered.position(static_cast<size_t>(numbers.data()[i])); }
  VertexId name(size_t i) const { return gathered.name(static_cast<size_t>(numbers.data()[i])); }
  WELLSPACE_INLINE void FindVectors(size_t i, const Point<D>& site, double scale, Floats* w) const {
    VectorsToEach<D>(
        [&](size_t k) __attribute__((always_inline))->const Point<D>& { return position(i + k); }, site, scale, w);
  }
  template <VectorUnit kUnit>
  WELLSPACE_INLINE FloatMask AreCalled(VertexId called, size_t i) const {
    const auto at = [&](size_t k) __attribute__((always_inline)) { return static_cast<int32_t>(Index(name(i + k))); };
    const FloatMask names = {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
    return IsEqual<kUnit>(names, Splat(static_cast<int32_t>(Index(called))));
  }
};

// Calls f(i, distances) for eight gathered vertices at a time, from the i-th on, with their squared distances from
// `site`, by their columns.
template <int D, typename F>
WELLSPACE_INLINE void ForEachDistanceSq(const GatheredVertices<D>& gathered, const Point<D>& site, F f) {
  Floats from[D];
  for (int axis = 0; axis < D; ++axis) {
    from[axis] = Splat(gathered.InColumn(site, axis));
  }
  for (size_t i = 0; i < gathered.count(); i += kFloatLanes) {
    Floats distance_sq{};
    for (int axis = 0; axis < D; ++axis) {
      Floats x;
      std::memcpy(&x, gathered.column(axis) + i, sizeof(x));
      x -= from[axis];
      distance_sq += x * x;
    }
    f(i, distance_sq);
  }
}

// Lists the numbers of the gathered vertices whose squared distance from `site`, by their columns, is more than
// `more_than_sq` and at most `most_sq`, and returns how many there are. Seven more are written.
template <VectorUnit kUnit, int D>
WELLSPACE_INLINE size_t ChooseBetween(const GatheredVertices<D>& gathered, const Point<D>& site, float more_than_sq,
                                      float most_sq, int32_t* numbers) {
  const Floats least = Splat(more_than_sq);
  const Floats most = Splat(most_sq);
  FloatMask eight = kEachLane;
  size_t count = 0;
  ForEachDistanceSq<D>(
      gathered, site, [&](size_t /*i*/, const Floats& distance_sq) __attribute__((always_inline)) {
        const uint32_t chosen = Bits<kUnit>(IsLess<kUnit>(least, distance_sq) & IsAtMost<kUnit>(distance_sq, most));
        const FloatMask in_order = WELLSPACE_SHUFFLE(eight, OrderOf<kUnit>(chosen));
        std::memcpy(numbers + count, &in_order, sizeof(in_order));
        count += static_cast<size_t>(std::popcount(chosen));
        eight += static_cast<int32_t>(kFloatLanes);
      });
  return count;
}

// Cuts a cell by those of the gathered vertices that are within its reach, the near ones first: by cut_by(vertices),
// which returns how many are, for up to kMostCutTogether at a time. Returns how many are.
template <VectorUnit kUnit, int D, typename Cell, typename CutBy>
WELLSPACE_INLINE size_t CutByThoseGathered(const Cell& cell, const GatheredVertices<D>& gathered, CutBy cut_by) {
  alignas(sizeof(FloatMask)) int32_t numbers[GatheredVertices<D>::kMost + kFloatLanes];
  size_t within_reach = 0;
  double limit_sq = std::min(gathered.near_sq(), cell.CutLimitSq());
  for (float more_than_sq = -1;;) {
    const float most_sq = gathered.MostSq(limit_sq);
    const size_t count = ChooseBetween<kUnit, D>(gathered, cell.site(), more_than_sq, most_sq, numbers);
    std::fill_n(numbers + count, kFloatLanes, 0);
    for (size_t i = 0; i < count && !cell.IsTooLarge(); i += kMostCutTogether) {
      within_reach += cut_by(VerticesChosen<D>{gathered, {numbers + i, std::min(count - i, kMostCutTogether)}});
    }
    if (cell.IsTooLarge() || cell.CutLimitSq() <= limit_sq) {
      return within_reach;
    }
    limit_sq = cell.CutLimitSq();
    more_than_sq = most_sq;
  }
}

// The largest x . w of nodes in groups, of eight vectors w side by side.
template <VectorUnit kUnit, int D, typename Group>
WELLSPACE_INLINE Floats MostProducts(std::span<const Group> groups, const Floats* w) {
  Floats most = Splat(-std::numeric_limits<float>::infinity());
  for (const Group& group : groups) {
    for (size_t i = 0; i < kFloatLanes; ++i) {
      Floats product = w[D - 1] * group.x[D - 1][i];
      for (int axis = D - 2; axis >= 0; --axis) {
        product = w[axis] * group.x[axis][i] + product;
      }
      most = Max<kUnit>(most, product);
    }
  }
  return most;
}

// The squared distances of the nodes of a group.
template <int D, typename Group>
WELLSPACE_INLINE Floats RadiiSq(const Group& group) {
  Floats radius_sq = Load(group.x[0]) * Load(group.x[0]);
  for (int axis = 1; axis < D; ++axis) {
    radius_sq += Load(group.x[axis]) * Load(group.x[axis]);
  }
  return radius_sq;
}

// Whether some vertex in the cube from `low` to `high`, relative to the site, could cut off a node, as
// Polytope::Reaches has it; nodes are within `most_radius`.
template <VectorUnit kUnit, int D, typename Group>
WELLSPACE_INLINE bool AreReached(std::span<const Group> groups, float most_radius, const Point<D>& low,
                                 const Point<D>& high) {
  FloatMask any{};
  const Floats doubt = Splat(kPowerError<D> * most_radius * most_radius + kUnderflow);
  for (const Group& group : groups) {
    Floats power{};
    for (int axis = 0; axis < D; ++axis) {
      const Floats x = Load(group.x[axis]);
      const Floats least = Splat(static_cast<float>(low[axis]));
      const Floats most = Splat(static_cast<float>(high[axis]));
      const Floats p = Min<kUnit>(Max<kUnit>(x, least), most);
      power += p * (p - 2 * x);
    }
    any |= IsAtMost<kUnit>(power, doubt);
  }
  return Bits<kUnit>(any) != 0;
}

// The vertices that may cut a cell, in columns; whole vectors are written, the last one perhaps from the last one on.
template <int D>
struct alignas(sizeof(Floats)) FloatCandidates {
  static constexpr size_t kMost = kMostCutTogether;
  static constexpr size_t kCapacity = kMost + kFloatLanes;

  float w[D][kCapacity];
  float offset[kCapacity];
  float low[kCapacity];
  int32_t slot[kCapacity];  // among the positions
  size_t count = 0;
  uint32_t order[kCapacity];  // from the nearest on, but for distances that agree to one part in 2^17
  size_t within_reach = 0;    // but for the site

  // Picks those of `vertices` but `site_name` that may cut a cell about `site` of that radius, and that `may_cut`:
  // given the vectors of eight and their lows, it tells which.
  template <VectorUnit kUnit, typename Vertices, typename MayCut>
  WELLSPACE_INLINE void Pick(const Vertices& vertices, VertexId site_name, const Point<D>& site, double scale,
                             float most_radius, MayCut may_cut) {
    const Floats far = Splat(MostOffset<D>(most_radius));
    const FloatMask end = Splat(static_cast<int32_t>(vertices.size()));
    const float error = kExcessError<D> * most_radius;
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
      const Floats offsets = 0.5f * length_sq;
      const Floats lows = offsets - (error * length + kUnderflow);
      FloatMask is_near = IsAtMost<kUnit>(offsets, far) & IsLess<kUnit>(slots, end);
      is_near &= ~vertices.template AreCalled<kUnit>(site_name, from);
      within_reach += static_cast<size_t>(std::popcount(Bits<kUnit>(is_near)));
      may_cut(vectors, lows, is_near);
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
      append(lows, low);
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
  // `most_offset`(), which may have changed then.
  template <typename Cut, typename Most>
  WELLSPACE_INLINE void CutInOrder(Cut cut, Most most_offset) const {
    float left = std::numeric_limits<float>::infinity();
    for (size_t j = 0; j < count; ++j) {
      const uint32_t i = order[j];
      FloatBisector<D> bisector;
      for (int axis = 0; axis < D; ++axis) {
        bisector.w[axis] = w[axis][i];
      }
      bisector.offset = offset[i];
      bisector.low = low[i];
      if (bisector.offset > left) {
        break;
      }
      if (cut(bisector, static_cast<size_t>(slot[i]))) {
        left = most_offset() * (1 + 0x1p-16f);  // those that follow may be nearer by as much
      }
    }
  }

 private:
  // By counting those before each.
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
        order[before[lane]] = static_cast<uint32_t>(first + lane);  // of what is none: after the last
      }
    }
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_CANDIDATES_H_
