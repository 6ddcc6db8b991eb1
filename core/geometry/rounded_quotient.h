// Integers of any size, and their quotients, to doubles.
#ifndef WELLSPACE_CORE_GEOMETRY_ROUNDED_QUOTIENT_H_
#define WELLSPACE_CORE_GEOMETRY_ROUNDED_QUOTIENT_H_

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace wellspace::core {

// value * 2^exponent for an integer of Boost.Multiprecision, cut off to 63 bits and then rounded.
template <typename BigInteger>
double Rounded(const BigInteger& value, int exponent) {
  if (value == 0) {
    return 0;
  }
  const BigInteger magnitude = abs(value);
  const int excess = std::max(0, static_cast<int>(msb(magnitude)) - 62);
  const auto head = static_cast<double>(static_cast<uint64_t>(BigInteger(magnitude >> excess)));
  return std::scalbn(value < 0 ? -head : head, exponent + excess);
}

// numerator / denominator * 2^exponent, within a relative error of 2^-50.
template <typename BigInteger>
double RoundedQuotient(const BigInteger& numerator, const BigInteger& denominator, int exponent) {
  if (numerator == 0) {
    return 0;
  }
  const int bits =
      static_cast<int>(msb(BigInteger(abs(denominator)))) - static_cast<int>(msb(BigInteger(abs(numerator))));
  const int shift = std::max(0, bits + 64);
  return Rounded(BigInteger((numerator << shift) / denominator), exponent - shift);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_ROUNDED_QUOTIENT_H_
