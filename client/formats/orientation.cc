#include "client/formats/orientation.h"

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

namespace wellspace::formats {
namespace {

// The determinant of the edges of a triangle or a tetrahedron from its last vertex, the sum of the magnitudes of its
// terms, and whether no product of edges comes near the ends of the range of double.
template <typename Number>
struct EdgeDeterminant {
  Number value = 0;
  Number magnitude = 0;
  bool is_in_range = true;
};

template <typename Number>
EdgeDeterminant<Number> DeterminantOf(std::span<const Number> corners) {
  using std::abs;
  const size_t dimension = corners.size() == 6 ? 2 : 3;
  std::array<std::array<Number, 3>, 3> edges;
  EdgeDeterminant<Number> sum;
  for (size_t i = 0; i < dimension; ++i) {
    for (size_t axis = 0; axis < dimension; ++axis) {
      Number& edge = edges[i][axis];
      edge = corners[i * dimension + axis] - corners[dimension * dimension + axis];
      if constexpr (std::is_same_v<Number, double>) {
        sum.is_in_range = sum.is_in_range && (edge == 0 || (abs(edge) > 1e-100 && abs(edge) < 1e100));
      }
    }
  }
  const auto add = [&sum](const Number& term) {
    sum.value += term;
    sum.magnitude += abs(term);
  };
  if (dimension == 2) {
    add(Number(edges[0][0] * edges[1][1]));
    add(Number(-edges[0][1] * edges[1][0]));
    return sum;
  }
  for (size_t i = 0; i < 3; ++i) {
    const auto& [a, b] = std::array{edges[(i + 1) % 3], edges[(i + 2) % 3]};
    add(Number(edges[i][0] * a[1] * b[2]));
    add(Number(-edges[i][0] * a[2] * b[1]));
  }
  return sum;
}

// The numbers as integers, all scaled by the same power of two.
using Integer = boost::multiprecision::cpp_int;
std::vector<Integer> Scaled(std::span<const double> numbers) {
  constexpr int kDigits = std::numeric_limits<double>::digits;
  int least = std::numeric_limits<int>::max();
  for (const double number : numbers) {
    int exponent = 0;
    if (std::frexp(number, &exponent) != 0) {
      least = std::min(least, exponent);
    }
  }
  std::vector<Integer> integers;
  integers.reserve(numbers.size());
  for (const double number : numbers) {
    int exponent = 0;
    const double fraction = std::frexp(number, &exponent);
    Integer& integer = integers.emplace_back(static_cast<int64_t>(std::ldexp(fraction, kDigits)));
    if (fraction != 0) {
      integer <<= exponent - least;
    }
  }
  return integers;
}

}  // namespace

int OrientationSign(std::span<const double> corners) {
  // A term has at most three rounded edges, two products, and is summed up with at most five others: nine roundings.
  constexpr double kBound = 16 * std::numeric_limits<double>::epsilon();
  const EdgeDeterminant<double> rounded = DeterminantOf(corners);
  if (rounded.is_in_range && std::abs(rounded.value) > kBound * rounded.magnitude) {
    return rounded.value > 0 ? 1 : -1;
  }
  const std::vector<Integer> integers = Scaled(corners);
  return DeterminantOf(std::span<const Integer>(integers)).value.sign();
}

}  // namespace wellspace::formats
