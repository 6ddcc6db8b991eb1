// FixedInteger against integers of any size, and minors against elimination.
#include "core/geometry/fixed_integer.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>

#include "core/geometry/minors.h"
#include "tests/support/bareiss.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

using boost::multiprecision::cpp_int;
using test::Seed;
using test::SplitMix64;

template <size_t Limbs>
cpp_int Unsigned(const std::array<uint64_t, Limbs>& limbs) {
  cpp_int value = 0;
  for (size_t i = Limbs; i > 0; --i) {
    value = (value << 64) + limbs[i - 1];
  }
  return value;
}

template <int Limbs>
cpp_int ValueOf(const FixedInteger<Limbs>& x) {
  const cpp_int value = Unsigned(x.limbs);
  return x.IsNegative() ? cpp_int(value - (cpp_int(1) << (64 * Limbs))) : value;
}

// Into [-2^(64 Limbs - 1), 2^(64 Limbs - 1)).
template <int Limbs>
cpp_int Wrapped(const cpp_int& value) {
  const cpp_int modulus = cpp_int(1) << (64 * Limbs);
  const cpp_int rest = ((value % modulus) + modulus) % modulus;
  return 2 * rest >= modulus ? cpp_int(rest - modulus) : rest;
}

// Limbs of all zeros and all ones make the longest carries.
uint64_t DrawLimb(SplitMix64& random) {
  switch (random.Below(4)) {
    case 0:
      return 0;
    case 1:
      return ~uint64_t{0};
    case 2:
      return uint64_t{1} << random.Below(64);
    default:
      return random.Next();
  }
}

template <int A, int B>
void CheckProducts() {
  const uint64_t seed = Seed(11);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (int round = 0; round < 3000; ++round) {
    FixedInteger<A + B> sum;
    SignedMagnitude<A> a{{}, random.Below(2) == 0};
    FixedInteger<B> b;
    for (uint64_t& limb : sum.limbs) {
      limb = DrawLimb(random);
    }
    for (uint64_t& limb : a.magnitude) {
      limb = DrawLimb(random);
    }
    for (uint64_t& limb : b.limbs) {
      limb = DrawLimb(random);
    }
    a.magnitude[A - 1] >>= 1;  // factors have their sign beside them, and a bit to spare
    const bool negate = random.Below(2) == 0;
    const cpp_int product = Unsigned(a.magnitude) * ValueOf(b) * (a.is_negative != negate ? -1 : 1);
    const cpp_int expected = Wrapped<A + B>(ValueOf(sum) + product);
    AddProduct(sum, a, negate, b);
    ASSERT_EQ(ValueOf(sum), expected);
    ASSERT_EQ(sum.IsNegative(), expected < 0);
    ASSERT_EQ(sum.IsZero(), expected == 0);
    const FixedInteger<A + B> copy = sum;
    sum.Add(copy, true);
    ASSERT_TRUE(sum.IsZero());
    ASSERT_FALSE(sum.IsNegative());
    sum.Add(copy, true);
    ASSERT_EQ(ValueOf(sum), Wrapped<A + B>(-ValueOf(copy)));
  }
}

TEST(FixedIntegerTest, ProductsAreThoseOfIntegers) {
  CheckProducts<1, 1>();
  CheckProducts<1, 2>();
  CheckProducts<1, 5>();
  CheckProducts<2, 2>();
  CheckProducts<2, 6>();
  CheckProducts<4, 12>();
}

struct IntegerRing {
  using Entry = cpp_int;
  template <int K>
  using Minor = cpp_int;
  static cpp_int ToMinor(const cpp_int& entry) { return entry; }
  static void AddProduct(cpp_int& sum, const cpp_int& entry, bool negate, const cpp_int& minor) {
    sum += (negate ? -1 : 1) * entry * minor;
  }
};

template <size_t N, size_t K>
void CheckMinors() {
  const uint64_t seed = Seed(12);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  std::array<std::array<cpp_int, K>, N> entries;
  for (auto& row : entries) {
    for (cpp_int& entry : row) {
      entry = static_cast<int>(random.Below(2001)) - 1000;
    }
  }
  const auto minors = MinorsOf<IntegerRing, static_cast<int>(K)>(entries);
  size_t number = 0;
  for (unsigned rows = 0; rows < (1u << N); ++rows) {
    if (std::popcount(rows) != static_cast<int>(K)) {
      continue;
    }
    std::array<std::array<cpp_int, K>, K> chosen;
    for (size_t row = 0, to = 0; row < N; ++row) {
      if (((rows >> row) & 1) != 0) {
        chosen[to++] = entries[row];
      }
    }
    EXPECT_EQ(minors[number++], test::BareissDeterminant<K>(chosen)) << "rows " << rows;
  }
  EXPECT_EQ(number, minors.size());
}

TEST(MinorsTest, AreDeterminantsOfTheirRows) {
  CheckMinors<3, 1>();
  CheckMinors<3, 2>();
  CheckMinors<4, 3>();
  CheckMinors<5, 4>();
  CheckMinors<6, 5>();
  CheckMinors<7, 6>();
  CheckMinors<7, 3>();
}

}  // namespace
}  // namespace wellspace::core
