#include "core/geometry/power_predicate.h"

#include <algorithm>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/dimensions.h"
#include "core/geometry/fixed_integer.h"
#include "core/geometry/integer_rings.h"
#include "core/geometry/minors.h"
#include "core/geometry/rounded_quotient.h"

namespace wellspace::core {
namespace {

// ---- The decision, whatever the type of its numbers

// Rows (n_j, 2 c_j) of the D planes, the last one (w_u, |w_u|^2), in multiples of one power of two. A wall's row is
// negated where its offset is negative: that changes the sign of both determinants, and the offsets are never negative.
template <typename Ring, int D>
struct Rows {
  std::array<std::array<typename Ring::Entry, D>, D + 1> normals;
  std::array<typename Ring::Offset, D + 1> offsets;
};

inline Sign SignOf(int64_t value) { return static_cast<Sign>((value > 0) - (value < 0)); }
inline Sign SignOf(Signed128 value) { return static_cast<Sign>((value > 0) - (value < 0)); }

template <typename Number>
Sign SignOf(const Number& value) {
  return static_cast<Sign>(value.sign());
}

template <int Limbs>
Sign SignOf(const FixedInteger<Limbs>& value) {
  return value.IsNegative() ? Sign::kNegative : value.IsZero() ? Sign::kZero : Sign::kPositive;
}

// The perturbation's word on an exact zero; see the header. `minors` as for Decide.
template <typename Ring, int D>
Sign BreakTie(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
              const std::array<typename Ring::template Minor<D>, D + 1>& minors) {
  const Sign a_sign = SignOf(minors[0]);
  // lambda_j det A is the determinant of A with w_u in the place of row j: the minor without row j, after D - 1 - j
  // exchanges of rows.
  auto site_coefficient = minors[0];
  Ring::Negate(site_coefficient);
  std::array<Sign, D> lambda;
  for (int j = 0; j < D; ++j) {
    const bool negate = (D - 1 - j) % 2 == 1;
    lambda[j] = negate ? -SignOf(minors[D - j]) : SignOf(minors[D - j]);
    if (!planes[j].IsWall()) {
      Ring::Add(site_coefficient, negate, minors[D - j]);
    }
  }
  // Of the vertices whose weights count the first by rank decides. The weight of u always does.
  const Point<D>* first = &u;
  Sign sign = Sign::kPositive;
  const auto rank = [&](const Point<D>& vertex, Sign coefficient) {
    if (coefficient != Sign::kZero && *first < vertex) {
      first = &vertex;
      sign = coefficient;
    }
  };
  rank(site, SignOf(site_coefficient) * a_sign);
  for (int j = 0; j < D; ++j) {
    if (!planes[j].IsWall()) {
      rank(planes[j].generator, -(lambda[j] * a_sign));
    }
  }
  return sign;
}

// `minors` are those of the rows without one, the last row first.
template <typename Ring, int D>
ExactDecision Decide(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u, TieRule rule,
                     const Rows<Ring, D>& rows, const std::array<typename Ring::template Minor<D>, D + 1>& minors) {
  ExactDecision decision;
  decision.stage = Ring::kStage;
  typename Ring::template Bordered<D> bordered{};
  for (int row = 0; row <= D; ++row) {
    Ring::AddProduct(bordered, rows.offsets[row], (row + D) % 2 == 1, minors[D - row]);
  }
  decision.sign = -(SignOf(bordered) * SignOf(minors[0]));
  if (decision.sign == Sign::kZero && rule == TieRule::kPerturb) {
    decision.sign = BreakTie<Ring, D>(site, planes, u, minors);
    decision.perturbed = true;
  }
  return decision;
}

// ---- The differences, and the rows that they are made into

// Two numbers side by side.
using Pair = double __attribute__((vector_size(16), may_alias));
using IntegerPair = int64_t __attribute__((vector_size(16), may_alias));

// Numbers by row and axis, and as pairs; the last of an odd row stands beside one that means nothing.
template <typename Number, int D>
struct alignas(Pair) Matrix {
  static constexpr int kPairs = (D + 1) / 2;  // of a row

  Number rows[D + 1][2 * kPairs];

  Pair& pair(int row, int i) { return reinterpret_cast<Pair*>(rows[row])[i]; }
  const Pair& pair(int row, int i) const { return reinterpret_cast<const Pair*>(rows[row])[i]; }
  IntegerPair& integer_pair(int row, int i) { return reinterpret_cast<IntegerPair*>(rows[row])[i]; }
};

// The differences of a decision, each as the sum of two doubles, the rounded one and its error: exact, unless it
// overflows.
//
// Source: D. E. Knuth, The Art of Computer Programming 2, section 4.2.2, Theorem B.
template <int D>
struct Differences {
  // A row for each plane, to its generator or, on the axis, to its wall; the last one to u.
  Matrix<double, D> high;
  Matrix<double, D> low;
  int exponent;  // all are below 2^(exponent + 1); 1024 if one overflowed

  Differences(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u) {
    Pair largest{};
    const auto pair_of = [](const Point<D>& p, int i) { return Pair{p[2 * i], 2 * i + 1 < D ? p[2 * i + 1] : 0}; };
    const auto subtract = [&](int row, int i, Pair a, Pair b) {
      const Pair difference = a - b;
      const Pair b_virtual = a - difference;
      const Pair a_virtual = difference + b_virtual;
      high.pair(row, i) = difference;
      low.pair(row, i) = (b_virtual - b) + (a - a_virtual);
      const Pair magnitude = difference > -difference ? difference : -difference;
      largest = magnitude > largest ? magnitude : largest;
    };
    for (int j = 0; j <= D; ++j) {
      if (j < D && planes[j].IsWall()) {
        const int axis = planes[j].axis;
        for (int i = 0; i < Matrix<double, D>::kPairs; ++i) {
          const Pair place{planes[j].coordinate, planes[j].coordinate};
          const Pair from = pair_of(site, i);
          const IntegerPair is_along{axis == 2 * i ? -1 : 0, axis == 2 * i + 1 ? -1 : 0};
          subtract(j, i, is_along != 0 ? place : from, from);
        }
        continue;
      }
      const Point<D>& end = j == D ? u : planes[j].generator;
      for (int i = 0; i < Matrix<double, D>::kPairs; ++i) {
        subtract(j, i, pair_of(end, i), pair_of(site, i));
      }
    }
    exponent = static_cast<int>(std::bit_cast<uint64_t>(std::max(largest[0], largest[1])) >> 52) - 1023;
  }
};

// Calls to_entry(row, axis, entry) for every difference and completes the rows; false as soon as one call is.
template <typename Ring, int D, typename ToEntry>
inline bool FillRows(const std::array<PlaneSource<D>, D>& planes, const DecisionWeights<D>* weights, int unit,
                     ToEntry to_entry, Rows<Ring, D>& rows) {
  for (int j = 0; j <= D; ++j) {
    if (j < D && planes[j].IsWall()) {
      const int axis = planes[j].axis;
      typename Ring::Entry offset{};
      if (!to_entry(j, axis, offset)) {
        return false;
      }
      rows.normals[j].fill(Ring::FromInteger(0));
      rows.normals[j][axis] = Ring::FromInteger(Ring::IsNegative(offset) ? -1 : 1);
      rows.offsets[j] = Ring::Twice(offset);
      continue;
    }
    rows.offsets[j] = {};
    for (int i = 0; i < D; ++i) {
      if (!to_entry(j, i, rows.normals[j][i])) {
        return false;
      }
      Ring::AddSquare(rows.offsets[j], rows.normals[j][i]);
    }
    if (weights != nullptr &&
        !(Ring::AddWeight(rows.offsets[j], weights->site, false, unit) &&
          Ring::AddWeight(rows.offsets[j], j < D ? weights->generators[j] : weights->u, true, unit))) {
      return false;
    }
  }
  return true;
}

// 2^exponent for -1022 <= exponent <= 1023.
double PowerOfTwo(int exponent) { return std::bit_cast<double>(static_cast<uint64_t>(exponent + 1023) << 52); }

// The rows in the unit in which the largest difference has all bits that the ring takes; false where some are
// no integers.
template <int D>
bool ToRows(const Differences<D>& differences, const std::array<PlaneSource<D>, D>& planes,
            const DecisionWeights<D>* weights, Rows<FixedRing<1>, D>& rows) {
  using Ring = FixedRing<1>;
  const int unit = differences.exponent - (Ring::kDifferenceBits - 1);
  if (unit < -1022 || differences.exponent > 1023) {
    return false;
  }
  const double factor = PowerOfTwo(-unit);
  const double inverse = PowerOfTwo(unit);
  // Of both products only the second has to be exact, and it is: an integer of 53 bits times a power of two that is a
  // normal number.
  const auto to_integer = [&](double x, int64_t& integer) {
    integer = static_cast<int64_t>(x * factor);
    return static_cast<double>(integer) * inverse == x;
  };
  return FillRows<Ring, D>(
      planes, weights, unit,
      [&](int row, int axis, Ring::Entry& entry) {
        int64_t whole = 0;
        if (!to_integer(differences.high.rows[row][axis], whole)) {
          return false;
        }
        if (const double low = differences.low.rows[row][axis]; low != 0) {
          int64_t rest = 0;
          if (!to_integer(low, rest)) {
            return false;
          }
          whole += rest;
        }
        entry = Ring::FromInteger(whole);
        return true;
      },
      rows);
}

// The rows in the unit in which the largest difference has all bits that a word takes; false where some are no
// integers. But a wall may be at a place that is none: its bit is set in `unfit_walls` then, and its offset means
// nothing.
template <int D>
bool ToWordRows(const Differences<D>& differences, const std::array<PlaneSource<D>, D>& planes,
                const DecisionWeights<D>* weights, Rows<WordRing<D>, D>& rows, uint32_t& unfit_walls) {
  const int unit = differences.exponent - (WordRing<D>::kDifferenceBits - 1);
  if (unit < -1022 || differences.exponent > 1023) {
    return false;
  }
  // A double of this size has no bits for fractions: adding it rounds, and leaves the integer in the last bits of the
  // sum.
  constexpr double kRound = 0x1.8p52;
  const double factor = PowerOfTwo(-unit);
  const double inverse = PowerOfTwo(unit);
  Matrix<int64_t, D> integers;
  Matrix<int64_t, D> unfit;  // 0 where it is one
  IntegerPair any{};
  for (int j = 0; j <= D; ++j) {
    for (int i = 0; i < Matrix<double, D>::kPairs; ++i) {
      const Pair x = differences.high.pair(j, i);
      const Pair rounded = x * factor + kRound;
      integers.integer_pair(j, i) = std::bit_cast<IntegerPair>(rounded) - std::bit_cast<int64_t>(kRound);
      unfit.integer_pair(j, i) = ((rounded - kRound) * inverse != x) | (differences.low.pair(j, i) != 0);
      any |= unfit.integer_pair(j, i);
    }
  }
  unfit_walls = 0;
  for (int j = 0; (any[0] | any[1]) != 0 && j <= D; ++j) {
    for (int i = 0; i < D; ++i) {
      if (unfit.rows[j][i] != 0) {
        if (j == D || !planes[j].IsWall()) {
          return false;
        }
        unfit_walls |= 1u << j;
        integers.rows[j][i] = differences.high.rows[j][i] < 0 ? -1 : 1;
      }
    }
  }
  return FillRows<WordRing<D>, D>(
      planes, weights, unit,
      [&](int row, int axis, int64_t& entry) {
        entry = integers.rows[row][axis];
        return true;
      },
      rows);
}

// The rows in units of the finest difference, if they fit in 126 bits.
template <int D>
bool ToRows(const Differences<D>& differences, const std::array<PlaneSource<D>, D>& planes,
            const DecisionWeights<D>* weights, Rows<FixedRing<2>, D>& rows) {
  if (differences.exponent > 1023) {
    return false;
  }
  int unit = std::numeric_limits<int>::max();
  for (int j = 0; j <= D; ++j) {
    for (int i = 0; i < D; ++i) {
      unit = std::min(
          {unit, Decompose(differences.high.rows[j][i]).exponent, Decompose(differences.low.rows[j][i]).exponent});
    }
  }
  // Subnormal numbers have an exponent field of 0.
  if (std::max(differences.exponent, -1022) + 1 - unit > FixedRing<2>::kDifferenceBits) {
    return false;
  }
  const auto to_integer = [unit](double x) -> Signed128 {
    const Scaled scaled = Decompose(x);
    return scaled.mantissa == 0 ? 0 : Signed128{scaled.mantissa} * (Signed128{1} << (scaled.exponent - unit));
  };
  return FillRows<FixedRing<2>, D>(
      planes, weights, unit,
      [&](int row, int axis, SignedMagnitude<2>& entry) {
        const Signed128 value =
            to_integer(differences.high.rows[row][axis]) + to_integer(differences.low.rows[row][axis]);
        const auto magnitude = static_cast<Unsigned128>(value < 0 ? -value : value);
        entry.is_negative = value < 0;
        entry.magnitude = {static_cast<uint64_t>(magnitude), static_cast<uint64_t>(magnitude >> 64)};
        return true;
      },
      rows);
}

// ---- Integers of any size

struct BigRing {
  // 512 bits are kept inside the object.
  using Integer = boost::multiprecision::number<
      boost::multiprecision::cpp_int_backend<512, 0, boost::multiprecision::signed_magnitude,
                                             boost::multiprecision::unchecked>,
      boost::multiprecision::et_off>;
  static constexpr Stage kStage = Stage::kBigInteger;
  using Entry = Integer;
  using Offset = Integer;
  template <int K>
  using Minor = Integer;
  template <int D>
  using Bordered = Integer;

  static Integer ToMinor(const Integer& entry) { return entry; }
  static void AddProduct(Integer& sum, const Integer& factor, bool negate, const Integer& minor) {
    Add(sum, negate, Integer(factor * minor));
  }
  static void Negate(Integer& value) { value = -value; }
  static void Add(Integer& sum, bool negate, const Integer& term) {
    if (negate) {
      sum -= term;
    } else {
      sum += term;
    }
  }
};

template <int D>
struct BigRows {
  Rows<BigRing, D> rows;
  int unit;  // of the differences, as an exponent of 2
};

// The rows from the coordinates: their differences could overflow.
template <int D>
BigRows<D> ToBigRows(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                     const DecisionWeights<D>* weights) {
  int unit = std::numeric_limits<int>::max();
  const auto include_weight = [&](double weight) {
    if (weight != 0) {
      unit = std::min(unit, (Decompose(weight).exponent - 1) / 2);  // not above half of it, whatever its sign
    }
  };
  if (weights != nullptr) {
    include_weight(weights->site);
    include_weight(weights->u);
    std::for_each(weights->generators.begin(), weights->generators.end(), include_weight);
  }
  const auto include = [&](double x) { unit = std::min(unit, Decompose(x).exponent); };
  std::for_each(site.begin(), site.end(), include);
  std::for_each(u.begin(), u.end(), include);
  for (const PlaneSource<D>& plane : planes) {
    if (plane.IsWall()) {
      include(plane.coordinate);
    } else {
      std::for_each(plane.generator.begin(), plane.generator.end(), include);
    }
  }
  const auto to_integer = [unit](double x) {
    const Scaled scaled = Decompose(x);
    return scaled.mantissa == 0 ? BigRing::Integer(0) : BigRing::Integer(scaled.mantissa) << (scaled.exponent - unit);
  };
  std::array<BigRing::Integer, D> origin;
  std::transform(site.begin(), site.end(), origin.begin(), to_integer);
  BigRows<D> big;
  big.unit = unit;
  Rows<BigRing, D>& rows = big.rows;
  for (int j = 0; j <= D; ++j) {
    if (j < D && planes[j].IsWall()) {
      const int axis = planes[j].axis;
      rows.normals[j][axis] = 1;
      rows.offsets[j] = 2 * (to_integer(planes[j].coordinate) - origin[axis]);
      continue;
    }
    const Point<D>& generator = j < D ? planes[j].generator : u;
    for (int i = 0; i < D; ++i) {
      rows.normals[j][i] = to_integer(generator[i]) - origin[i];
      rows.offsets[j] += rows.normals[j][i] * rows.normals[j][i];
    }
    if (weights != nullptr) {
      const auto to_square = [unit](double weight) {
        const Scaled scaled = Decompose(weight);
        return scaled.mantissa == 0 ? BigRing::Integer(0)
                                    : BigRing::Integer(scaled.mantissa) << (scaled.exponent - 2 * unit);
      };
      rows.offsets[j] += to_square(weights->site) - to_square(j < D ? weights->generators[j] : weights->u);
    }
  }
  return big;
}

}  // namespace

namespace {

// Decides by all stages but the first, in a function of its own: the first is not to reserve stack for long integers.
template <int D>
[[gnu::noinline]] ExactDecision DecideByLongIntegers(const Differences<D>& differences, const Point<D>& site,
                                                     const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                                                     const DecisionWeights<D>* weights, TieRule rule) {
  const auto decide = [&]<typename Ring>(const Rows<Ring, D>& rows) {
    return Decide<Ring, D>(site, planes, u, rule, rows, MinorsOf<Ring, D>(rows.normals));
  };
  if (Rows<FixedRing<1>, D> rows; ToRows<D>(differences, planes, weights, rows)) {
    return decide(rows);
  }
  if (Rows<FixedRing<2>, D> rows; ToRows<D>(differences, planes, weights, rows)) {
    return decide(rows);
  }
  return decide(ToBigRows<D>(site, planes, u, weights).rows);
}

// `weights` is null where all are zero.
template <int D>
ExactDecision DecideByStages(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                             const DecisionWeights<D>* weights, TieRule rule) {
  const Differences<D> differences(site, planes, u);
  uint32_t unfit_walls = 0;
  if (Rows<WordRing<D>, D> rows; ToWordRows<D>(differences, planes, weights, rows, unfit_walls)) {
    const auto minors = MinorsOf<WordRing<D>, D>(rows.normals);
    bool is_exact = true;
    for (int j = 0; j < D; ++j) {
      is_exact &= (unfit_walls >> j & 1) == 0 || minors[D - j] == 0;  // unless its factor is 0
    }
    if (is_exact) {
      return Decide<WordRing<D>, D>(site, planes, u, rule, rows, minors);
    }
  }
  return DecideByLongIntegers<D>(differences, site, planes, u, weights, rule);
}

}  // namespace

template <int D>
ExactDecision DecideCut(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                        TieRule rule) {
  return DecideByStages<D>(site, planes, u, nullptr, rule);
}

template <int D>
ExactDecision DecidePowerCut(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                             const DecisionWeights<D>& weights, TieRule rule) {
  return DecideByStages<D>(site, planes, u, &weights, rule);
}

template <int D>
Point<D> ExactMeetingPoint(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes) {
  // In units of 2^unit the coordinates solve 2 n_j . x = 2 c_j; by Cramer's rule.
  const BigRows<D> big = ToBigRows<D>(site, planes, site, nullptr);
  std::array<std::array<BigRing::Integer, D>, D> normals;
  std::copy_n(big.rows.normals.begin(), D, normals.begin());
  const BigRing::Integer determinant = MinorsOf<BigRing, D>(normals)[0];
  Point<D> x;
  for (int k = 0; k < D; ++k) {
    auto replaced = normals;
    for (int j = 0; j < D; ++j) {
      replaced[j][k] = big.rows.offsets[j];
    }
    x[k] = RoundedQuotient(MinorsOf<BigRing, D>(replaced)[0], determinant, big.unit - 1);
  }
  return x;
}

#define WELLSPACE_INSTANTIATE(D)                                                                                   \
  template ExactDecision DecideCut<D>(const Point<D>&, const std::array<PlaneSource<D>, D>&, const Point<D>&,      \
                                      TieRule);                                                                    \
  template ExactDecision DecidePowerCut<D>(const Point<D>&, const std::array<PlaneSource<D>, D>&, const Point<D>&, \
                                           const DecisionWeights<D>&, TieRule);                                    \
  template Point<D> ExactMeetingPoint<D>(const Point<D>&, const std::array<PlaneSource<D>, D>&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
