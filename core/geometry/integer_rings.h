// Integers of few sizes, in which the determinants of a decision are computed: Decide of power_predicate.cc.
#ifndef WELLSPACE_CORE_GEOMETRY_INTEGER_RINGS_H_
#define WELLSPACE_CORE_GEOMETRY_INTEGER_RINGS_H_

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/geometry/fixed_integer.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// ---- Doubles as integers

// A double as mantissa * 2^exponent, the mantissa odd or zero.
struct Scaled {
  int64_t mantissa = 0;
  int exponent = 0;
};

inline Scaled Decompose(double value) {
  if (value == 0) {
    return {0, std::numeric_limits<int>::max()};
  }
  int exponent = 0;
  const auto mantissa = static_cast<int64_t>(std::ldexp(std::frexp(value, &exponent), 53));
  const int zeros = std::countr_zero(static_cast<uint64_t>(mantissa));
  return {mantissa >> zeros, exponent - 53 + zeros};
}

// ---- Integers of one word

// Differences d of coordinates with |d| < 2^b, b = floor((63 - 2 D) / D) = 29, 19, 13, 10, 8 for D = 2, ..., 6.
//
// Nothing overflows, on the way neither. A sum of products in a minor of k rows is at most k! 2^(k b), in the
// coefficient of the site (D + 1)! 2^(D b): below 2^61, 2^62, 2^59, 2^60, 2^61. An offset is at most D 2^(2 b), with
// weights twice that, below 2^61. The bordered determinant is a sum of D + 1 products of the two, below 2^127.
template <int D>
struct WordRing {
  static constexpr Stage kStage = Stage::kWord;
  static constexpr int kDifferenceBits = (63 - 2 * D) / D;
  using Entry = int64_t;
  using Offset = int64_t;
  template <int K>
  using Minor = int64_t;
  template <int K>
  using Bordered = Signed128;

  static int64_t ToMinor(int64_t entry) { return entry; }
  template <typename Sum>
  static void AddProduct(Sum& sum, int64_t factor, bool negate, int64_t minor) {
    Add(sum, negate, Sum{factor} * minor);
  }
  static void Negate(int64_t& value) { value = -value; }
  template <typename Sum>
  static void Add(Sum& sum, bool negate, Sum term) {
    sum += negate ? -term : term;
  }

  static int64_t FromInteger(int64_t value) { return value; }
  static bool IsNegative(int64_t entry) { return entry < 0; }
  static int64_t Twice(int64_t entry) { return 2 * (entry < 0 ? -entry : entry); }
  static void AddSquare(int64_t& sum, int64_t entry) { sum += entry * entry; }
  // As that of FixedRing.
  static bool AddWeight(int64_t& sum, double weight, bool negate, int unit) {
    if (weight == 0) {
      return true;
    }
    const Scaled scaled = Decompose(weight);
    const int shift = scaled.exponent - 2 * unit;
    if (shift < 0 || std::ilogb(weight) - 2 * unit > 2 * kDifferenceBits + 1) {
      return false;
    }
    Add(sum, negate, scaled.mantissa << shift);
    return true;
  }
};

// ---- Integers of fixed width

// Differences d of coordinates with |d| < 2^b, b = 64 B - 2, in B limbs.
//
// All results fit. A minor of k rows is at most k^(k/2) 2^(k b) (Hadamard), and k/2 log2 k <= 0, 1, 3, 4, 6, 8 for k =
// 1, ..., 6: with its sign k b + 9 bits at most for k = 6, and 64 B k = k b + 2 k are there (k = 2: 2 b + 2 of 2 b + 4;
// 3: + 4 of 6; 4: + 5 of 8; 5: + 7 of 10; 6: + 9 of 12). An offset is a sum of D squares, with a weight at most twice
// that, below 2^(2 b + 4), or twice a difference, in 2 B limbs of 2 b + 4 bits. The bordered determinant is a sum of D
// + 1 products of the two: below 2^((D + 2) b) times 2 D (D + 1) D^(D/2), with its sign (D + 2) b + 6, 9, 11, 13, 16
// bits for D = 2, ..., 6, and there are (D + 2) b + 2 (D + 2) = ... + 8, 10, 12, 14, 16. The coefficient of the site is
// a sum of D + 1 minors of D rows: D b + 4, 6, 8, 10, 12 bits, and exactly so many are there. Sums on the way may wrap:
// arithmetic is modulo a power of two.
template <int B>
struct FixedRing {
  static constexpr Stage kStage = B == 1 ? Stage::kInteger : Stage::kWideInteger;
  static constexpr int kDifferenceBits = 64 * B - 2;
  using Entry = SignedMagnitude<B>;
  using Offset = SignedMagnitude<2 * B>;
  template <int K>
  using Minor = FixedInteger<K * B>;
  template <int D>
  using Bordered = FixedInteger<(D + 2) * B>;

  static Minor<1> ToMinor(const Entry& entry) {
    Minor<1> minor;
    minor.Add({entry.magnitude}, entry.is_negative);
    return minor;
  }
  template <int L, int M, int N>
  static void AddProduct(FixedInteger<L>& sum, const SignedMagnitude<M>& factor, bool negate,
                         const FixedInteger<N>& minor) {
    core::AddProduct(sum, factor, negate, minor);
  }
  template <int L>
  static void Negate(FixedInteger<L>& value) {
    const FixedInteger<L> copy = value;
    value = {};
    value.Add(copy, true);
  }
  template <int L>
  static void Add(FixedInteger<L>& sum, bool negate, const FixedInteger<L>& term) {
    sum.Add(term, negate);
  }

  static Entry FromInteger(int64_t value) {
    Entry entry{{}, value < 0};
    entry.magnitude[0] = static_cast<uint64_t>(value < 0 ? -value : value);
    return entry;
  }
  static bool IsNegative(const Entry& entry) { return entry.is_negative; }
  static void AddSquare(Offset& sum, const Entry& entry) {
    if constexpr (B == 1) {
      const Unsigned128 total = (Unsigned128{sum.magnitude[1]} << 64 | sum.magnitude[0]) +
                                Unsigned128{entry.magnitude[0]} * entry.magnitude[0];
      sum.magnitude = {static_cast<uint64_t>(total), static_cast<uint64_t>(total >> 64)};
    } else {
      FixedInteger<2 * B> total{sum.magnitude};
      core::AddProduct(total, Entry{entry.magnitude, false}, false, FixedInteger<B>{entry.magnitude});
      sum.magnitude = total.limbs;
    }
  }
  // Adds a weight, or takes it off, in the square of the unit of entries, 2^unit; false where it is no integer of it.
  // Sums may wrap on the way: the last one is not negative.
  static bool AddWeight(Offset& sum, double weight, bool negate, int unit) {
    if (weight == 0) {
      return true;
    }
    const Scaled scaled = Decompose(weight);
    const int shift = scaled.exponent - 2 * unit;
    if (shift < 0 || shift + 53 > 2 * kDifferenceBits) {
      return false;
    }
    FixedInteger<2 * B> term;
    const Unsigned128 bits = Unsigned128{static_cast<uint64_t>(scaled.mantissa)} << (shift % 64);
    term.limbs[shift / 64] = static_cast<uint64_t>(bits);
    if (shift / 64 + 1 < 2 * B) {
      term.limbs[shift / 64 + 1] = static_cast<uint64_t>(bits >> 64);
    }
    FixedInteger<2 * B> total{sum.magnitude};
    total.Add(term, negate);
    sum.magnitude = total.limbs;
    return true;
  }
  static Offset Twice(const Entry& entry) {
    Offset offset{{}, false};
    uint64_t carry = 0;
    for (int i = 0; i < B; ++i) {
      offset.magnitude[i] = entry.magnitude[i] << 1 | carry;
      carry = entry.magnitude[i] >> 63;
    }
    return offset;
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_INTEGER_RINGS_H_
