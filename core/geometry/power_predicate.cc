#include "core/geometry/power_predicate.h"

#include <algorithm>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstring>
#include <limits>

namespace wellspace::core {
namespace {

using BigInteger = boost::multiprecision::number<
    boost::multiprecision::cpp_int_backend<512, 0, boost::multiprecision::signed_magnitude,
                                           boost::multiprecision::unchecked>,
    boost::multiprecision::et_off>;
__extension__ using Integer128 = __int128;

// A double as mantissa * 2^exponent, the mantissa odd or zero.
struct Scaled {
  int64_t mantissa = 0;
  int exponent = 0;
};

Scaled Decompose(double value) {
  if (value == 0) {
    return {0, std::numeric_limits<int>::max()};
  }
  int exponent = 0;
  const auto mantissa = static_cast<int64_t>(std::ldexp(std::frexp(value, &exponent), 53));
  const int zeros = std::countr_zero(static_cast<uint64_t>(mantissa));
  return {mantissa >> zeros, exponent - 53 + zeros};
}

template <typename Int>
Int ScaledTo(const Scaled& value, int exponent) {
  if (value.mantissa == 0) {
    return Int(0);
  }
  return Int(value.mantissa) << (value.exponent - exponent);
}

template <typename Int>
Sign SignOf(const Int& value) {
  return value > 0 ? Sign::kPositive : value < 0 ? Sign::kNegative : Sign::kZero;
}

// Expansion by the first row.
template <typename Int, int N>
Int Determinant(const std::array<std::array<Int, N>, N>& m) {
  if constexpr (N == 1) {
    return m[0][0];
  } else if constexpr (N == 2) {
    return m[0][0] * m[1][1] - m[0][1] * m[1][0];
  } else {
    Int sum(0);
    for (int skip = 0; skip < N; ++skip) {
      if (m[0][skip] == 0) {
        continue;
      }
      std::array<std::array<Int, N - 1>, N - 1> minor;
      for (int row = 1; row < N; ++row) {
        for (int column = 0, to = 0; column < N; ++column) {
          if (column != skip) {
            minor[row - 1][to++] = m[row][column];
          }
        }
      }
      const Int term = m[0][skip] * Determinant<Int, N - 1>(minor);
      sum = skip % 2 == 0 ? Int(sum + term) : Int(sum - term);
    }
    return sum;
  }
}

// The coordinates that a decision depends on, and their common scale.
template <int D>
struct Operands {
  std::array<Scaled, D> site;
  std::array<std::array<Scaled, D>, D> generators;  // of bisectors
  std::array<Scaled, D> walls;
  std::array<Scaled, D> u;
  int low_exponent = std::numeric_limits<int>::max();
  int high_exponent = std::numeric_limits<int>::min();  // all absolute values are below 2^high_exponent

  void Include(const Scaled& value) {
    if (value.mantissa != 0) {
      low_exponent = std::min(low_exponent, value.exponent);
      high_exponent =
          std::max(high_exponent,
                   value.exponent + static_cast<int>(std::bit_width(static_cast<uint64_t>(std::abs(value.mantissa)))));
    }
  }
};

template <typename Int, int D>
ExactDecision Decide(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u, TieRule rule,
                     const Operands<D>& operands) {
  ExactDecision decision;
  const int scale = operands.low_exponent;
  std::array<Int, D> origin;
  for (int i = 0; i < D; ++i) {
    origin[i] = ScaledTo<Int>(operands.site[i], scale);
  }
  // Rows (n_j, 2 c_j), then (w_u, 2 c_u).
  std::array<std::array<Int, D + 1>, D + 1> bordered;
  const auto set_bisector = [&](std::array<Int, D + 1>& row, const std::array<Scaled, D>& generator) {
    row[D] = Int(0);
    for (int i = 0; i < D; ++i) {
      row[i] = ScaledTo<Int>(generator[i], scale) - origin[i];
      row[D] += row[i] * row[i];
    }
  };
  for (int j = 0; j < D; ++j) {
    if (planes[j].IsWall()) {
      bordered[j].fill(Int(0));
      const int axis = planes[j].axis;
      bordered[j][axis] = Int(1);
      bordered[j][D] = 2 * (ScaledTo<Int>(operands.walls[j], scale) - origin[axis]);
    } else {
      set_bisector(bordered[j], operands.generators[j]);
    }
  }
  set_bisector(bordered[D], operands.u);

  std::array<std::array<Int, D>, D> a;
  for (int row = 0; row < D; ++row) {
    std::copy_n(bordered[row].begin(), D, a[row].begin());
  }
  const Sign a_sign = SignOf(Determinant<Int, D>(a));
  decision.sign = -(SignOf(Determinant<Int, D + 1>(bordered)) * a_sign);
  if (decision.sign != Sign::kZero || rule == TieRule::kKeep) {
    return decision;
  }

  decision.perturbed = true;
  // lambda_j det A is the determinant of A with row j replaced by w_u.
  std::array<Int, D> lambda;
  Int site_coefficient = -Determinant<Int, D>(a);
  for (int j = 0; j < D; ++j) {
    auto replaced = a;
    std::copy_n(bordered[D].begin(), D, replaced[j].begin());
    lambda[j] = Determinant<Int, D>(replaced);
    if (!planes[j].IsWall()) {
      site_coefficient += lambda[j];
    }
  }
  // The vertices by rank, with the signs of their weights' coefficients.
  struct Weighted {
    const Point<D>* vertex;
    Sign coefficient;
  };
  std::array<Weighted, D + 2> ranked;
  int count = 0;
  const auto insert = [&](const Point<D>& vertex, Sign coefficient) {
    int at = count++;
    for (; at > 0 && *ranked[at - 1].vertex < vertex; --at) {
      ranked[at] = ranked[at - 1];
    }
    ranked[at] = {&vertex, coefficient};
  };
  insert(u, Sign::kPositive);
  insert(site, SignOf(site_coefficient) * a_sign);
  for (int j = 0; j < D; ++j) {
    if (!planes[j].IsWall()) {
      insert(planes[j].generator, -(SignOf(lambda[j]) * a_sign));
    }
  }
  for (int k = 0; k < count && decision.sign == Sign::kZero; ++k) {
    decision.sign = ranked[k].coefficient;
  }
  return decision;
}

}  // namespace

template <int D>
ExactDecision DecideCut(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                        TieRule rule) {
  Operands<D> operands;
  const auto decompose = [&](const Point<D>& p, std::array<Scaled, D>& to) {
    for (int i = 0; i < D; ++i) {
      to[i] = Decompose(p[i]);
      operands.Include(to[i]);
    }
  };
  decompose(site, operands.site);
  decompose(u, operands.u);
  for (int j = 0; j < D; ++j) {
    if (planes[j].IsWall()) {
      operands.walls[j] = Decompose(planes[j].coordinate);
      operands.Include(operands.walls[j]);
    } else {
      decompose(planes[j].generator, operands.generators[j]);
    }
  }
  if (operands.low_exponent == std::numeric_limits<int>::max()) {
    operands.low_exponent = 0;  // every coordinate is zero
    operands.high_exponent = 0;
  }
  // With b bits a coordinate, a difference has b + 1 and a squared norm 2 (b + 1) + ceil(log2 D): so the bordered
  // determinant, a sum of (D + 1)! products of D differences and a norm, has at most (D + 2) (b + 1) + ceil(log2 D) +
  // ceil(log2 (D + 1)!) bits; the sum of lambdas has fewer.
  const int bits = operands.high_exponent - operands.low_exponent;
  constexpr int kSlack = D == 2 ? 1 + 3 : D == 3 ? 2 + 5 : 3 + 13;
  ExactDecision decision;
  if ((D + 2) * (bits + 1) + kSlack <= 126) {
    decision = Decide<Integer128, D>(site, planes, u, rule, operands);
    decision.stage = Stage::kInteger;
  } else {
    decision = Decide<BigInteger, D>(site, planes, u, rule, operands);
    decision.stage = Stage::kBigInteger;
  }
  return decision;
}

template ExactDecision DecideCut<2>(const Point<2>&, const std::array<PlaneSource<2>, 2>&, const Point<2>&, TieRule);
template ExactDecision DecideCut<3>(const Point<3>&, const std::array<PlaneSource<3>, 3>&, const Point<3>&, TieRule);

}  // namespace wellspace::core
