// Eight floats, or 32-bit integers, at a time: comparisons, choices, the order of some lanes. For files that are
// compiled for several vector units: all is compiled into its callers.
#ifndef WELLSPACE_CORE_BASE_SIMD_FLOAT_LANES_H_
#define WELLSPACE_CORE_BASE_SIMD_FLOAT_LANES_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"

// Vectors that are passed and returned never are: all that does so is compiled into its callers.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace wellspace::core {

WELLSPACE_INLINE Floats Load(const float* items) { return *reinterpret_cast<const Floats*>(items); }
WELLSPACE_INLINE Floats& VectorAt(float* items) { return *reinterpret_cast<Floats*>(items); }
WELLSPACE_INLINE FloatMask& VectorAt(int32_t* items) { return *reinterpret_cast<FloatMask*>(items); }
WELLSPACE_INLINE Floats Splat(float x) { return x + Floats{}; }
WELLSPACE_INLINE FloatMask Splat(int32_t x) { return x + FloatMask{}; }

inline constexpr FloatMask kEachLane = {0, 1, 2, 3, 4, 5, 6, 7};

// Comparisons and choices, half a vector at a time where the processor has no whole ones: of these the compiler would
// make scalars.
WELLSPACE_INLINE const HalfFloats* HalvesOf(const Floats& items) { return reinterpret_cast<const HalfFloats*>(&items); }
WELLSPACE_INLINE const HalfMask* HalvesOf(const FloatMask& items) { return reinterpret_cast<const HalfMask*>(&items); }

template <VectorUnit kUnit, typename Vector, typename Compare>
WELLSPACE_INLINE FloatMask Compared(const Vector& a, const Vector& b, Compare compare) {
  if constexpr (kUnit == VectorUnit::kAvx2) {
    return compare(a, b);
  } else {
    FloatMask result;
    for (size_t half = 0; half < 2; ++half) {
      reinterpret_cast<HalfMask*>(&result)[half] = compare(HalvesOf(a)[half], HalvesOf(b)[half]);
    }
    return result;
  }
}
// The items of a and b are both floats, or both integers.
template <VectorUnit kUnit, typename Vector>
WELLSPACE_INLINE FloatMask IsLess(const Vector& a, const Vector& b) {
  return Compared<kUnit>(
      a, b, [](const auto& x, const auto& y) __attribute__((always_inline)) { return x < y; });
}
template <VectorUnit kUnit, typename Vector>
WELLSPACE_INLINE FloatMask IsAtMost(const Vector& a, const Vector& b) {
  return Compared<kUnit>(
      a, b, [](const auto& x, const auto& y) __attribute__((always_inline)) { return x <= y; });
}
template <VectorUnit kUnit, typename Vector>
WELLSPACE_INLINE FloatMask IsEqual(const Vector& a, const Vector& b) {
  return Compared<kUnit>(
      a, b, [](const auto& x, const auto& y) __attribute__((always_inline)) { return x == y; });
}
// `a` where the mask is set, else `b`.
template <VectorUnit kUnit>
WELLSPACE_INLINE FloatMask Choose(const FloatMask& mask, const FloatMask& a, const FloatMask& b) {
  if constexpr (kUnit == VectorUnit::kAvx2) {
    return mask ? a : b;
  } else {
    return b ^ ((a ^ b) & mask);
  }
}
template <VectorUnit kUnit>
WELLSPACE_INLINE Floats Choose(const FloatMask& mask, const Floats& a, const Floats& b) {
  if constexpr (kUnit == VectorUnit::kAvx2) {
    return mask ? a : b;
  } else {
    return reinterpret_cast<Floats>(
        Choose<kUnit>(mask, reinterpret_cast<const FloatMask&>(a), reinterpret_cast<const FloatMask&>(b)));
  }
}
template <VectorUnit kUnit>
WELLSPACE_INLINE Floats Max(const Floats& a, const Floats& b) {
  if constexpr (kUnit == VectorUnit::kAvx2) {
    return a > b ? a : b;
  } else {
    Floats result;
    for (size_t half = 0; half < 2; ++half) {
      const HalfFloats& x = HalvesOf(a)[half];
      const HalfFloats& y = HalvesOf(b)[half];
      reinterpret_cast<HalfFloats*>(&result)[half] = x > y ? x : y;
    }
    return result;
  }
}
template <VectorUnit kUnit>
WELLSPACE_INLINE Floats Min(const Floats& a, const Floats& b) {
  if constexpr (kUnit == VectorUnit::kAvx2) {
    return a < b ? a : b;
  } else {
    return -Max<kUnit>(-a, -b);
  }
}

template <VectorUnit kUnit>
WELLSPACE_INLINE float Largest(const Floats& items) {
  if constexpr (kUnit == VectorUnit::kAvx2) {
    Floats largest = items;
    const auto with = [&](const FloatMask& order) __attribute__((always_inline)) {
      const Floats other = WELLSPACE_SHUFFLE(largest, order);
      largest = largest > other ? largest : other;
    };
    with(FloatMask{4, 5, 6, 7, 0, 1, 2, 3});
    with(FloatMask{2, 3, 0, 1, 6, 7, 4, 5});
    with(FloatMask{1, 0, 3, 2, 5, 4, 7, 6});
    return largest[0];
  } else {
    float largest = items[0];
    for (size_t lane = 1; lane < kFloatLanes; ++lane) {
      largest = std::max(largest, items[lane]);
    }
    return largest;
  }
}

// By the bits of the lanes that are kept: which lanes these are, in order.
inline constexpr std::array<std::array<uint8_t, kFloatLanes>, 256> kOrders = [] {
  std::array<std::array<uint8_t, kFloatLanes>, 256> orders{};
  for (uint32_t bits = 0; bits < 256; ++bits) {
    size_t next = 0;
    for (uint8_t lane = 0; lane < kFloatLanes; ++lane) {
      if ((bits >> lane & 1) != 0) {
        orders[bits][next++] = lane;
      }
    }
  }
  return orders;
}();

template <VectorUnit kUnit>
WELLSPACE_INLINE FloatMask OrderOf(uint32_t kept) {
#if defined(WELLSPACE_X86_BUILTINS)
  if constexpr (kUnit == VectorUnit::kAvx2) {
    using Bytes = char __attribute__((vector_size(16)));
    using Words = int64_t __attribute__((vector_size(16)));
    int64_t order;
    std::memcpy(&order, kOrders[kept].data(), sizeof(order));
    const Words words = {order, 0};
    return reinterpret_cast<FloatMask>(__builtin_ia32_pmovzxbd256(reinterpret_cast<Bytes>(words)));
  }
#endif
  FloatMask order;
  for (size_t i = 0; i < kFloatLanes; ++i) {
    order[i] = kOrders[kept][i];
  }
  return order;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_SIMD_FLOAT_LANES_H_
