// Signed integers of a width fixed while compiling, for sums of products whose size is known in advance.
#ifndef WELLSPACE_CORE_GEOMETRY_FIXED_INTEGER_H_
#define WELLSPACE_CORE_GEOMETRY_FIXED_INTEGER_H_

#include <array>
#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace wellspace::core {

__extension__ using Unsigned128 = unsigned __int128;
__extension__ using Signed128 = __int128;

// a + b + carry; carry is 0 or 1 before and after. The intrinsic is there because g++ 12 makes no chain of adc out of
// the other half: that costs exact decisions 15 % more time in 3-D, 50 % in 5-D.
inline uint64_t AddWithCarry(uint64_t a, uint64_t b, unsigned char& carry) {
#if defined(__x86_64__)
  unsigned long long sum = 0;
  carry = _addcarry_u64(carry, a, b, &sum);
  return sum;
#else
  const Unsigned128 sum = Unsigned128{a} + b + carry;
  carry = static_cast<unsigned char>(sum >> 64);
  return static_cast<uint64_t>(sum);
#endif
}

// Two's complement, lowest limb first: arithmetic is modulo 2^(64 Limbs), so intermediate results may wrap as long as
// the last one fits.
template <int Limbs>
struct FixedInteger {
  std::array<uint64_t, Limbs> limbs{};

  bool IsNegative() const { return (limbs[Limbs - 1] >> 63) != 0; }
  bool IsZero() const {
    uint64_t any = 0;
    for (const uint64_t limb : limbs) {
      any |= limb;
    }
    return any == 0;
  }

  // this += other, or this -= other. With an all-ones mask, -x = ~x + 1.
  void Add(const FixedInteger& other, bool negate = false) {
    const uint64_t mask = negate ? ~uint64_t{0} : 0;
    auto carry = static_cast<unsigned char>(mask & 1);
    for (int i = 0; i < Limbs; ++i) {
      limbs[i] = AddWithCarry(limbs[i], other.limbs[i] ^ mask, carry);
    }
  }
};

// A factor by its absolute value and its sign.
template <int Limbs>
struct SignedMagnitude {
  std::array<uint64_t, Limbs> magnitude;
  bool is_negative;
};

// sum += a b, or sum -= a b.
//
// As an unsigned number b is 2^(64 B) more where it is negative, so that much of a is taken off the product again.
template <int A, int B>
inline void AddProduct(FixedInteger<A + B>& sum, const SignedMagnitude<A>& a, bool negate, const FixedInteger<B>& b) {
  FixedInteger<A + B> product;
  for (int i = 0; i < A; ++i) {
    uint64_t carry = 0;
    for (int j = 0; j < B; ++j) {
      const Unsigned128 term = Unsigned128{a.magnitude[i]} * b.limbs[j] + product.limbs[i + j] + carry;
      product.limbs[i + j] = static_cast<uint64_t>(term);
      carry = static_cast<uint64_t>(term >> 64);
    }
    product.limbs[i + B] = carry;
  }
  const uint64_t excess = b.IsNegative() ? ~uint64_t{0} : 0;
  unsigned char carry = 1;  // x - y = x + ~y + 1
  for (int i = 0; i < A; ++i) {
    product.limbs[B + i] = AddWithCarry(product.limbs[B + i], ~(a.magnitude[i] & excess), carry);
  }
  sum.Add(product, a.is_negative != negate);
}

// The same where every factor is one limb: the processor multiplies those with their signs.
inline void AddProduct(FixedInteger<2>& sum, const SignedMagnitude<1>& a, bool negate, const FixedInteger<1>& b) {
  const auto factor = static_cast<int64_t>(a.magnitude[0]);
  const Signed128 product = Signed128{a.is_negative != negate ? -factor : factor} * static_cast<int64_t>(b.limbs[0]);
  const Unsigned128 total = (Unsigned128{sum.limbs[1]} << 64 | sum.limbs[0]) + static_cast<Unsigned128>(product);
  sum.limbs = {static_cast<uint64_t>(total), static_cast<uint64_t>(total >> 64)};
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_FIXED_INTEGER_H_
