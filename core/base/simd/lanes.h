// Doubles that are worked on side by side, in the vectors of the processor.
#ifndef WELLSPACE_CORE_BASE_SIMD_LANES_H_
#define WELLSPACE_CORE_BASE_SIMD_LANES_H_

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace wellspace::core {

// Items that are looked at together; columns are as long as a multiple of it.
inline constexpr size_t kLanes = 4;

// How many items a column has for `count`.
constexpr size_t PaddedCount(size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

// The instructions that columns are worked on with; the results are the same to the bit.
enum class VectorUnit {
  kBaseline,  // the instructions of every processor of the architecture
  kAvx2,
};

// Whether this processor has it.
inline bool Has(VectorUnit unit) {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  return unit == VectorUnit::kBaseline || has_avx2;
#else
  return unit == VectorUnit::kBaseline;
#endif
}

// The best that this processor has.
inline VectorUnit BestVectorUnit() { return Has(VectorUnit::kAvx2) ? VectorUnit::kAvx2 : VectorUnit::kBaseline; }

// A function for each unit holds the same inlined body, with vectors as wide as the unit's.
#define WELLSPACE_INLINE [[gnu::always_inline]] inline
#if defined(__x86_64__)
#define WELLSPACE_AVX2 [[gnu::target("avx2")]]
#if !defined(__clang__)  // which has others, and none where a function is inlined into one for a unit
#define WELLSPACE_X86_BUILTINS
#endif
#else
#define WELLSPACE_AVX2
#endif

// The lanes of one vector, or of two in a row, in the order that the last argument has: __builtin_shuffle of g++, which
// clang, the compiler of the fuzzers, does not have. A macro, so that g++ sees an order that is constant.
#if defined(__clang__)
template <typename Vector, typename Order>
WELLSPACE_INLINE Vector Shuffled(const Vector& a, const Vector& b, const Order& order) {
  constexpr size_t kCount = sizeof(Vector) / sizeof(a[0]);
  Vector result = a;
  for (size_t i = 0; i < kCount; ++i) {
    const size_t from = static_cast<size_t>(order[i]) % (2 * kCount);
    result[i] = from < kCount ? a[from] : b[from - kCount];
  }
  return result;
}
template <typename Vector, typename Order>
WELLSPACE_INLINE Vector Shuffled(const Vector& a, const Order& order) {
  constexpr size_t kCount = sizeof(Vector) / sizeof(a[0]);
  Vector result = a;
  for (size_t i = 0; i < kCount; ++i) {
    result[i] = a[static_cast<size_t>(order[i]) % kCount];
  }
  return result;
}
#define WELLSPACE_SHUFFLE(...) Shuffled(__VA_ARGS__)
#else
#define WELLSPACE_SHUFFLE(...) __builtin_shuffle(__VA_ARGS__)
#endif

// Doubles in one vector, the result of comparing them (-1 where it holds, else 0), and as wide a vector of integers
// of 32 bits.
template <size_t kWidth>
struct Wide;
template <>
struct Wide<2> {
  using Lanes = double __attribute__((vector_size(16), may_alias));
  using Mask = int64_t __attribute__((vector_size(16), may_alias));
  using Halves = int32_t __attribute__((vector_size(16), may_alias));
};
template <>
struct Wide<4> {
  using Lanes = double __attribute__((vector_size(32), may_alias));
  using Mask = int64_t __attribute__((vector_size(32), may_alias));
  using Halves = int32_t __attribute__((vector_size(32), may_alias));
};

// Eight floats, and the result of comparing them: one vector with AVX2, else two.
using Floats = float __attribute__((vector_size(32), may_alias));
using FloatMask = int32_t __attribute__((vector_size(32), may_alias));
inline constexpr size_t kFloatLanes = 8;
using HalfFloats = float __attribute__((vector_size(16), may_alias));
using HalfMask = int32_t __attribute__((vector_size(16), may_alias));

// The items of `column` from `from` on, as one vector.
//
// REQUIRES:   both aligned to the vector.
template <size_t kWidth>
WELLSPACE_INLINE auto& LanesAt(double* column, size_t from) {
  return *reinterpret_cast<typename Wide<kWidth>::Lanes*>(column + from);
}
template <size_t kWidth>
WELLSPACE_INLINE const auto& LanesAt(const double* column, size_t from) {
  return *reinterpret_cast<const typename Wide<kWidth>::Lanes*>(column + from);
}

// Puts the columns of four rows into `out`.
WELLSPACE_INLINE void Transpose(const Wide<4>::Lanes& a, const Wide<4>::Lanes& b, const Wide<4>::Lanes& c,
                                const Wide<4>::Lanes& d, Wide<4>::Lanes* out) {
  using Lanes = Wide<4>::Lanes;
  using Order = Wide<4>::Mask;
  const Lanes even_ab = WELLSPACE_SHUFFLE(a, b, Order{0, 4, 2, 6});
  const Lanes odd_ab = WELLSPACE_SHUFFLE(a, b, Order{1, 5, 3, 7});
  const Lanes even_cd = WELLSPACE_SHUFFLE(c, d, Order{0, 4, 2, 6});
  const Lanes odd_cd = WELLSPACE_SHUFFLE(c, d, Order{1, 5, 3, 7});
  out[0] = WELLSPACE_SHUFFLE(even_ab, even_cd, Order{0, 1, 4, 5});
  out[1] = WELLSPACE_SHUFFLE(odd_ab, odd_cd, Order{0, 1, 4, 5});
  out[2] = WELLSPACE_SHUFFLE(even_ab, even_cd, Order{2, 3, 6, 7});
  out[3] = WELLSPACE_SHUFFLE(odd_ab, odd_cd, Order{2, 3, 6, 7});
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_SIMD_LANES_H_
