// Comparisons of doubles side by side as bits. Apart from lanes.h for the large header that it needs.
#ifndef WELLSPACE_CORE_BASE_SIMD_LANE_BITS_H_
#define WELLSPACE_CORE_BASE_SIMD_LANE_BITS_H_

#if defined(WELLSPACE_X86_BUILTINS)
#include <immintrin.h>
#endif

#include <cstddef>
#include <cstdint>

#include "core/base/simd/lanes.h"

namespace wellspace::core {

// A bit for each lane in which a comparison holds.
template <size_t kWidth>
WELLSPACE_INLINE uint32_t Bits(const typename Wide<kWidth>::Mask& mask) {
#if defined(WELLSPACE_X86_BUILTINS)
  if constexpr (kWidth == 4) {
    return static_cast<uint32_t>(__builtin_ia32_movmskpd256(reinterpret_cast<const Wide<4>::Lanes&>(mask)));
  } else {
    return static_cast<uint32_t>(__builtin_ia32_movmskpd(reinterpret_cast<const Wide<2>::Lanes&>(mask)));
  }
#else
  uint32_t bits = 0;
  for (size_t lane = 0; lane < kWidth; ++lane) {
    bits |= static_cast<uint32_t>(mask[lane] & 1) << lane;
  }
  return bits;
#endif
}

// The bits of a mask for floats; also of signs.
template <VectorUnit kUnit>
WELLSPACE_INLINE uint32_t Bits(const FloatMask& mask) {
#if defined(WELLSPACE_X86_BUILTINS)
  if constexpr (kUnit == VectorUnit::kAvx2) {
    return static_cast<uint32_t>(__builtin_ia32_movmskps256(reinterpret_cast<const Floats&>(mask)));
  }
  const auto* halves = reinterpret_cast<const HalfFloats*>(&mask);
  return static_cast<uint32_t>(__builtin_ia32_movmskps(halves[0]) | __builtin_ia32_movmskps(halves[1]) << 4);
#else
  uint32_t bits = 0;
  for (size_t lane = 0; lane < kFloatLanes; ++lane) {
    bits |= (mask[lane] < 0 ? 1u : 0u) << lane;
  }
  return bits;
#endif
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_SIMD_LANE_BITS_H_
