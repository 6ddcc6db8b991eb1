#include "core/geometry/exact_measure.h"

#include <algorithm>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/dimensions.h"
#include "core/geometry/rounded_quotient.h"

namespace wellspace::core {
namespace {

// 512 bits are kept inside the object: enough for the determinants of most clouds without any allocation.
using BigInteger = boost::multiprecision::number<
    boost::multiprecision::cpp_int_backend<512, 0, boost::multiprecision::signed_magnitude,
                                           boost::multiprecision::unchecked>,
    boost::multiprecision::et_off>;

template <typename T, int N>
using Matrix = std::array<std::array<T, N>, N>;

// A determinant by expansion by the first row, every minor computed once: those of the last k rows are wanted for every
// k columns only. `Sum` adds up the terms of one minor: Add(entry, minor, negative).
//
// Complexity: N 2^(N-1) products; expansion without remembering takes e N!.
template <typename Sum, typename T, int N>
Sum Expand(const Matrix<T, N>& m) {
  std::array<Sum, 1 << N> minors;  // by columns
  for (unsigned columns = 1; columns < (1u << N); ++columns) {
    const int rows = std::popcount(columns);
    bool negative = false;
    for (int column = 0; column < N; ++column) {
      if (((columns >> column) & 1) != 0) {
        const T& entry = m[N - rows][column];
        if (rows == 1) {
          minors[columns] = Sum(entry);
        } else {
          minors[columns].Add(entry, minors[columns & ~(1u << column)], negative);
        }
        negative = !negative;
      }
    }
  }
  return minors.back();
}

constexpr int Factorial(int n) { return n <= 1 ? 1 : n * Factorial(n - 1); }

// ---- The filter

template <int N>
inline Matrix<double, N - 1> MinorOfFirstRow(const Matrix<double, N>& m, int skip) {
  Matrix<double, N - 1> minor;
  for (int row = 1; row < N; ++row) {
    for (int column = 0, to = 0; column < N; ++column) {
      if (column != skip) {
        minor[row - 1][to++] = m[row][column];
      }
    }
  }
  return minor;
}

// A determinant in doubles, and its permanent: the same expansion over absolute values.
struct Estimate {
  double determinant = 0;
  double permanent = 0;

  Estimate() = default;
  explicit Estimate(double entry) : determinant(entry), permanent(std::abs(entry)) {}
  Estimate(double the_determinant, double the_permanent) : determinant(the_determinant), permanent(the_permanent) {}
  void Add(double entry, const Estimate& minor, bool negative) {
    const double term = entry * minor.determinant;
    determinant = negative ? determinant - term : determinant + term;
    permanent += std::abs(entry) * minor.permanent;
  }
};

// Up to 4 rows the compiler turns the plain recursion into straight code, faster than Expand with its fewer products
// (measured: 74 ns against 112 for the in-sphere test in 3-D). Both add up the same terms in the same order.
template <int N>
inline Estimate EstimateDeterminant(const Matrix<double, N>& m) {
  if constexpr (N == 1) {
    return Estimate(m[0][0]);
  } else if constexpr (N <= 4) {
    Estimate sum;
    for (int column = 0; column < N; ++column) {
      sum.Add(m[0][column], EstimateDeterminant<N - 1>(MinorOfFirstRow<N>(m, column)), column % 2 == 1);
    }
    return sum;
  } else {
    return Expand<Estimate, double, N>(m);
  }
}

// Every one of the N! products of the expansion passes through the roundings of its N entries, N - 1 multiplications
// and, at the levels of 2 to N, at most 1, ..., N - 1 additions that count (the first, to zero, is exact).
constexpr int ExpansionRoundings(int n) { return (n - 1) + n * (n - 1) / 2; }

// The sign of the determinant that `estimate` approximates, when it is certain.
//
// Let K be the largest number of roundings that a product passes through, u = 2^-53. Without underflow each product
// carries a factor in [(1 - u)^K, (1 + u)^K], so |error| <= g P, g = K u / (1 - K u), P the exact permanent; the
// computed permanent is at least (1 - g) P. g / (1 - g) < (K + 1) u for K < 100, and one more u covers the rounding of
// the bound itself; the largest K is that of the in-sphere test in 6-D, 41. Underflow: entries are scaled to absolute
// values below 2 (lifted ones below 4 D), there are fewer than 2^11 operations, and each adds less than 2^-1074 to a
// minor, which is multiplied by a permanent of the other rows, below 6! 2^6 24 < 2^21: below 2^-1000 in all. NaN and
// infinities fail the comparison.
std::optional<Sign> CertainSign(const Estimate& estimate, int roundings) {
  const double bound = (roundings + 2) * 0x1p-53 * estimate.permanent + 0x1p-1000;
  if (estimate.determinant > bound) {
    return Sign::kPositive;
  }
  if (estimate.determinant < -bound) {
    return Sign::kNegative;
  }
  return std::nullopt;
}

template <int D, size_t Count>
struct Scaled {
  std::array<Point<D>, Count> points;
  double factor = 1;
};

// points[i] - origin, all scaled by the same power of two to a largest absolute value in [1, 2), or below where that
// power would overflow. Every difference is rounded once.
template <int D, size_t Count>
Scaled<D, Count> ScaledDifferences(const std::array<Point<D>, Count>& points, const Point<D>& origin) {
  Scaled<D, Count> out;
  double largest = 0;
  for (size_t i = 0; i < Count; ++i) {
    out.points[i] = Difference<D>(points[i], origin);
    for (const double x : out.points[i]) {
      largest = std::max(largest, std::abs(x));
    }
  }
  if (largest > 0 && std::isfinite(largest)) {
    out.factor = std::scalbn(1.0, std::min(-std::ilogb(largest), 1000));
    for (Point<D>& difference : out.points) {
      for (double& x : difference) {
        x *= out.factor;
      }
    }
  }
  return out;
}

template <int D>
std::optional<Sign> FilterOrientation(const Simplex<D>& simplex) {
  std::array<Point<D>, D> corners;
  std::copy_n(simplex.begin() + 1, D, corners.begin());
  // One rounding in each of the D entries of a product.
  return CertainSign(EstimateDeterminant<D>(ScaledDifferences<D, D>(corners, simplex[0]).points),
                     D + ExpansionRoundings(D));
}

// The orientation in the plane without scaling, where the sign is clear, and nothing that counts is out of range.
std::optional<Sign> GlanceOrientation(const Simplex<2>& simplex) {
  const double left = (simplex[1][0] - simplex[0][0]) * (simplex[2][1] - simplex[0][1]);
  const double right = (simplex[1][1] - simplex[0][1]) * (simplex[2][0] - simplex[0][0]);
  const double determinant = left - right;
  const double permanent = std::abs(left) + std::abs(right);
  // Two roundings of differences, one of a product, and one of their difference, each 2^-53: less than half of this.
  constexpr double kRoundings = 0x1p-50;
  constexpr double kLeast = 0x1p-900;  // beside it underflow does not count
  if (!(std::abs(determinant) > kRoundings * permanent && permanent > kLeast &&
        permanent < std::numeric_limits<double>::infinity())) {
    return std::nullopt;
  }
  return determinant > 0 ? Sign::kPositive : Sign::kNegative;
}

// The orientation in space, likewise.
std::optional<Sign> GlanceOrientation(const Simplex<3>& simplex) {
  const Point<3> a = Difference<3>(simplex[1], simplex[0]);
  const Point<3> b = Difference<3>(simplex[2], simplex[0]);
  const Point<3> c = Difference<3>(simplex[3], simplex[0]);
  double determinant = 0;
  double permanent = 0;
  double size = 0;
  for (size_t i = 0; i < 3; ++i) {
    const double left = a[(i + 1) % 3] * b[(i + 2) % 3];
    const double right = a[(i + 2) % 3] * b[(i + 1) % 3];
    determinant += (left - right) * c[i];
    permanent += (std::abs(left) + std::abs(right)) * std::abs(c[i]);
    size += std::abs(c[i]);
  }
  // Three roundings of differences, two of products, one of a difference and two of sums: half of this.
  constexpr double kRoundings = 0x1p-49;
  constexpr double kLeast = 0x1p-800;  // beside it, and beside so much of a factor, underflow does not count
  if (!(std::abs(determinant) > kRoundings * permanent && permanent > kLeast && permanent > kLeast * size &&
        permanent < std::numeric_limits<double>::infinity())) {
    return std::nullopt;
  }
  return determinant > 0 ? Sign::kPositive : Sign::kNegative;
}

template <int D>
std::optional<Sign> FilterInSphere(const Simplex<D>& simplex, const Point<D>& q) {
  const std::array<Point<D>, D + 1> differences = ScaledDifferences<D, D + 1>(simplex, q).points;
  Matrix<double, D + 1> rows;
  for (int i = 0; i <= D; ++i) {
    std::copy_n(differences[i].begin(), D, rows[i].begin());
    rows[i][D] = NormSq<D>(differences[i]);
  }
  // D entries are differences; the lifted one has 2 of differences, 1 of the square and D - 1 of the sum.
  return CertainSign(EstimateDeterminant<D + 1>(rows), D + (D + 2) + ExpansionRoundings(D + 1));
}

// The same with weights, at most the square of the largest difference. A lifted entry is a sum of which only the terms
// bound the error, so the permanent is that of the terms' absolute values; two more roundings add them up.
template <int D>
std::optional<Sign> FilterInPowerSphere(const Simplex<D>& simplex, const std::array<double, D + 1>& weights,
                                        const Point<D>& q, double q_weight) {
  const auto [differences, factor] = ScaledDifferences<D, D + 1>(simplex, q);
  Matrix<double, D + 1> rows;
  Matrix<double, D + 1> magnitudes;
  const double lift = q_weight * factor * factor;
  for (int i = 0; i <= D; ++i) {
    std::copy_n(differences[i].begin(), D, rows[i].begin());
    std::copy_n(differences[i].begin(), D, magnitudes[i].begin());
    const double norm_sq = NormSq<D>(differences[i]);
    const double weight = weights[i] * factor * factor;
    if (!(std::abs(weight) <= 1 && std::abs(lift) <= 1)) {
      return std::nullopt;
    }
    rows[i][D] = norm_sq - weight + lift;
    magnitudes[i][D] = norm_sq + std::abs(weight) + std::abs(lift);
  }
  const Estimate estimate{EstimateDeterminant<D + 1>(rows).determinant,
                          EstimateDeterminant<D + 1>(magnitudes).permanent};
  return CertainSign(estimate, D + (D + 4) + ExpansionRoundings(D + 1));
}

// ---- The exact stage

// A double as mantissa * 2^exponent, the mantissa odd or zero.
struct Dyadic {
  int64_t mantissa = 0;
  int exponent = 0;
};

Dyadic ToDyadic(double value) {
  if (value == 0) {
    return {};
  }
  int exponent = 0;
  const auto mantissa = static_cast<int64_t>(std::scalbn(std::frexp(value, &exponent), 53));
  const int zeros = std::countr_zero(static_cast<uint64_t>(mantissa));
  return {mantissa / (int64_t{1} << zeros), exponent - 53 + zeros};
}

// Points as integers: points[i][k] * 2^exponent.
template <int D, size_t Count>
struct Grid {
  std::array<std::array<BigInteger, D>, Count> points;
  int exponent = 0;
};

// The points on the coarsest grid of a power of two that holds all of their coordinates.
template <int D, size_t Count>
Grid<D, Count> ToGrid(const std::array<Point<D>, Count>& points) {
  std::array<std::array<Dyadic, D>, Count> dyadic;
  int exponent = std::numeric_limits<int>::max();
  for (size_t i = 0; i < Count; ++i) {
    for (int k = 0; k < D; ++k) {
      dyadic[i][k] = ToDyadic(points[i][k]);
      if (dyadic[i][k].mantissa != 0) {
        exponent = std::min(exponent, dyadic[i][k].exponent);
      }
    }
  }
  Grid<D, Count> grid;
  grid.exponent = exponent == std::numeric_limits<int>::max() ? 0 : exponent;
  for (size_t i = 0; i < Count; ++i) {
    for (int k = 0; k < D; ++k) {
      if (dyadic[i][k].mantissa != 0) {
        grid.points[i][k] = dyadic[i][k].mantissa;
        grid.points[i][k] <<= dyadic[i][k].exponent - grid.exponent;
      }
    }
  }
  return grid;
}

struct BigSum {
  BigInteger value = 0;

  BigSum() = default;
  explicit BigSum(const BigInteger& entry) : value(entry) {}
  void Add(const BigInteger& entry, const BigSum& minor, bool negative) {
    const BigInteger term = entry * minor.value;
    if (negative) {
      value -= term;
    } else {
      value += term;
    }
  }
};

template <int N>
BigInteger Determinant(const Matrix<BigInteger, N>& m) {
  return Expand<BigSum, BigInteger, N>(m).value;
}

Sign SignOf(const BigInteger& value) { return static_cast<Sign>(value.sign()); }

// The rows p_i - p_0 on the grid of the corners.
template <int D>
Matrix<BigInteger, D> EdgeRows(const Grid<D, D + 1>& grid) {
  Matrix<BigInteger, D> rows;
  for (int i = 0; i < D; ++i) {
    for (int k = 0; k < D; ++k) {
      rows[i][k] = grid.points[i + 1][k] - grid.points[0][k];
    }
  }
  return rows;
}

template <size_t N>
BigInteger NormSq(const std::array<BigInteger, N>& row) {
  BigInteger sum = 0;
  for (const BigInteger& x : row) {
    sum += x * x;
  }
  return sum;
}

}  // namespace

template <int D>
MeasuredSign Orientation(const Simplex<D>& simplex) {
  if constexpr (D == 2 || D == 3) {
    if (const std::optional<Sign> sign = GlanceOrientation(simplex)) {
      return {*sign, Stage::kFilter};
    }
  }
  if (const std::optional<Sign> sign = FilterOrientation<D>(simplex)) {
    return {*sign, Stage::kFilter};
  }
  return {SignOf(Determinant<D>(EdgeRows<D>(ToGrid<D, D + 1>(simplex)))), Stage::kBigInteger};
}

namespace {

// det(p_i - q, |p_i - q|^2 - W_i + W_q) has the sign (-1)^D for q inside a simplex of positive orientation.
template <int D>
constexpr Sign kInside = D % 2 == 0 ? Sign::kPositive : Sign::kNegative;

template <int D>
Sign ExactInPowerSphere(const Simplex<D>& simplex, const std::array<double, D + 1>& weights, const Point<D>& q,
                        double q_weight) {
  std::array<Point<D>, D + 2> points;
  std::copy(simplex.begin(), simplex.end(), points.begin());
  points[D + 1] = q;
  const Grid<D, D + 2> grid = ToGrid<D, D + 2>(points);
  // Lifted entries in a unit 2^finer smaller than the square of the grid's, in which the weights are integers too.
  std::array<Dyadic, D + 2> lifts;
  int finer = 0;
  for (int i = 0; i <= D + 1; ++i) {
    lifts[i] = ToDyadic(i <= D ? weights[i] : q_weight);
    if (lifts[i].mantissa != 0) {
      finer = std::max(finer, 2 * grid.exponent - lifts[i].exponent);
    }
  }
  const auto to_integer = [&](const Dyadic& lift) {
    BigInteger value = lift.mantissa;
    if (lift.mantissa != 0) {
      value <<= lift.exponent - (2 * grid.exponent - finer);
    }
    return value;
  };
  Matrix<BigInteger, D + 1> rows;
  for (int i = 0; i <= D; ++i) {
    std::array<BigInteger, D> difference;
    for (int k = 0; k < D; ++k) {
      difference[k] = grid.points[i][k] - grid.points[D + 1][k];
    }
    std::copy(difference.begin(), difference.end(), rows[i].begin());
    rows[i][D] = NormSq(difference);
    rows[i][D] <<= finer;
    rows[i][D] += to_integer(lifts[D + 1]) - to_integer(lifts[i]);
  }
  return SignOf(Determinant<D + 1>(rows)) * kInside<D>;
}

}  // namespace

template <int D>
MeasuredSign InSphere(const Simplex<D>& simplex, const Point<D>& q) {
  if (const std::optional<Sign> sign = FilterInSphere<D>(simplex, q)) {
    return {*sign * kInside<D>, Stage::kFilter};
  }
  return {ExactInPowerSphere<D>(simplex, {}, q, 0), Stage::kBigInteger};
}

template <int D>
MeasuredSign InPowerSphere(const Simplex<D>& simplex, const std::array<double, D + 1>& weights, const Point<D>& q,
                           double q_weight) {
  if (const std::optional<Sign> sign = FilterInPowerSphere<D>(simplex, weights, q, q_weight)) {
    return {*sign * kInside<D>, Stage::kFilter};
  }
  return {ExactInPowerSphere<D>(simplex, weights, q, q_weight), Stage::kBigInteger};
}

template <int D>
Point<D> ExactCircumcentreOffset(const Simplex<D>& simplex) {
  // With rows w_i = p_i - p_0, the centre x solves w_i . x = |w_i|^2 / 2; by Cramer's rule.
  const Grid<D, D + 1> grid = ToGrid<D, D + 1>(simplex);
  const Matrix<BigInteger, D> edges = EdgeRows<D>(grid);
  const BigInteger determinant = Determinant<D>(edges);
  Point<D> offset;
  if (determinant == 0) {
    offset.fill(std::numeric_limits<double>::infinity());
    return offset;
  }
  for (int k = 0; k < D; ++k) {
    Matrix<BigInteger, D> replaced = edges;
    for (int i = 0; i < D; ++i) {
      replaced[i][k] = NormSq(edges[i]);
    }
    offset[k] = RoundedQuotient(Determinant<D>(replaced), determinant, grid.exponent - 1);
  }
  return offset;
}

// The sum is total * 2^exponent / D!.
template <int D>
struct ExactVolumeSum<D>::Impl {
  BigInteger total = 0;
  int exponent = 0;

  void AddTerm(BigInteger term, int term_exponent) {
    if (term_exponent < exponent) {
      total <<= exponent - term_exponent;
      exponent = term_exponent;
    } else {
      term <<= term_exponent - exponent;
    }
    total += term;
  }
};

template <int D>
ExactVolumeSum<D>::ExactVolumeSum() : impl_(std::make_unique<Impl>()) {}

template <int D>
ExactVolumeSum<D>::~ExactVolumeSum() = default;

template <int D>
void ExactVolumeSum<D>::Add(const Simplex<D>& simplex) {
  const Grid<D, D + 1> grid = ToGrid<D, D + 1>(simplex);
  impl_->AddTerm(Determinant<D>(EdgeRows<D>(grid)), D * grid.exponent);
}

template <int D>
void ExactVolumeSum<D>::Subtract(const Box<D>& box) {
  const Grid<D, 2> grid = ToGrid<D, 2>({box.low, box.high});
  BigInteger volume = Factorial(D);
  for (int k = 0; k < D; ++k) {
    volume *= grid.points[1][k] - grid.points[0][k];
  }
  impl_->AddTerm(-volume, D * grid.exponent);
}

template <int D>
Sign ExactVolumeSum<D>::sign() const {
  return SignOf(impl_->total);
}

template <int D>
double ExactVolumeSum<D>::value() const {
  return Rounded(impl_->total, impl_->exponent) / Factorial(D);
}

#define WELLSPACE_INSTANTIATE(D)                                                                               \
  template MeasuredSign Orientation<D>(const Simplex<D>&);                                                     \
  template MeasuredSign InSphere<D>(const Simplex<D>&, const Point<D>&);                                       \
  template MeasuredSign InPowerSphere<D>(const Simplex<D>&, const std::array<double, D + 1>&, const Point<D>&, \
                                         double);                                                              \
  template Point<D> ExactCircumcentreOffset<D>(const Simplex<D>&);                                             \
  template class ExactVolumeSum<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
