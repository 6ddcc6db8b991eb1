// Vertices as floats, eight at a time: vectors from a site to those of a leaf (ContiguousVertices) or to some of those
// that have been gathered (ChosenVertices). For cell_on_unit.h and gathered_vertices.cc, into whose functions all is
// compiled.
#ifndef WELLSPACE_CORE_CELL_FLOAT_VERTICES_H_
#define WELLSPACE_CORE_CELL_FLOAT_VERTICES_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "core/base/ids.h"
#include "core/base/simd/float_lanes.h"
#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"
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
struct ContiguousVertices {
  std::span<const Point<D>> positions;
  const VertexNames& names;

  size_t size() const { return positions.size(); }
  const Point<D>& position(size_t i) const { return positions[i]; }
  VertexId name(size_t i) const { return names[i]; }
  // To eight from the i-th on.
  WELLSPACE_INLINE void FindVectors(size_t i, const Point<D>& site, double scale, Floats* w) const {
    VectorsTo(&positions[i], site, scale, w);
  }
  // The lanes of vertices from the i-th on that have this name.
  template <VectorUnit kUnit>
  WELLSPACE_INLINE FloatMask AreNamed(VertexId name, size_t i) const {
    FloatMask listed{};
    if (names.listed != nullptr) {
      std::memcpy(&listed, names.listed + i, sizeof(listed));
      listed = IsEqual<kUnit>(listed, Splat(static_cast<int32_t>(Index(name))));
    }
    return listed;
  }
};

// Some of the gathered vertices, by number; beyond the last there are seven more numbers of any.
template <int D>
struct ChosenVertices {
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
  WELLSPACE_INLINE FloatMask AreNamed(VertexId called, size_t i) const {
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

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_VERTICES_H_
