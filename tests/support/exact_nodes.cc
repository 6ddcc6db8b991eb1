#include "tests/support/exact_nodes.h"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/dimensions.h"
#include "tests/support/bareiss.h"

namespace wellspace::test {
namespace {

using boost::multiprecision::cpp_int;
using core::CellNode;
using core::PlaneSource;
using core::Point;
using core::Polytope;

// A power of two that `value` is a multiple of.
int ExponentOf(double value) {
  int exponent = 0;
  return value == 0 ? 0 : (std::frexp(value, &exponent), exponent - 53);
}

// value / 2^exponent.
//
// REQUIRES:   value is a multiple of 2^exponent.
cpp_int InUnits(double value, int exponent) {
  if (value == 0) {
    return 0;
  }
  const int own = ExponentOf(value);
  const cpp_int mantissa = static_cast<int64_t>(std::ldexp(value, -own));
  return own >= exponent ? cpp_int(mantissa << (own - exponent)) : cpp_int(mantissa >> (exponent - own));
}

// numerator / denominator * 2^exponent, with a positive denominator; 0 where the planes do not meet in one point.
template <int D>
struct MeetingPoint {
  std::array<cpp_int, D> numerator;
  cpp_int denominator;
  int exponent;

  MeetingPoint(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes) {
    int unit = 0;
    for (const double x : site) {
      unit = std::min(unit, ExponentOf(x));
    }
    for (const PlaneSource<D>& plane : planes) {
      unit = std::min(unit, ExponentOf(plane.coordinate));
      for (const double x : plane.generator) {
        unit = std::min(unit, ExponentOf(x));
      }
    }
    exponent = unit - 1;  // offsets are twice as large as they should be
    std::array<std::array<cpp_int, D>, D> normals;
    std::array<cpp_int, D> offsets;
    for (int j = 0; j < D; ++j) {
      const PlaneSource<D>& plane = planes[j];
      if (plane.IsWall()) {
        normals[j][plane.axis] = 1;
        offsets[j] = 2 * (InUnits(plane.coordinate, unit) - InUnits(site[plane.axis], unit));
        continue;
      }
      for (int i = 0; i < D; ++i) {
        normals[j][i] = InUnits(plane.generator[i], unit) - InUnits(site[i], unit);
        offsets[j] += normals[j][i] * normals[j][i];
      }
    }
    denominator = BareissDeterminant<D>(normals);
    const int sign = denominator.sign();
    denominator *= sign;
    for (int k = 0; k < D && sign != 0; ++k) {
      auto replaced = normals;
      for (int j = 0; j < D; ++j) {
        replaced[j][k] = offsets[j];
      }
      numerator[k] = sign * BareissDeterminant<D>(replaced);
    }
  }

  // The common unit of this and `values`.
  int UnitWith(const std::vector<double>& values) const {
    int unit = exponent;
    for (const double x : values) {
      unit = std::min(unit, ExponentOf(x));
    }
    return unit;
  }

  cpp_int NumeratorInUnits(int k, int unit) const { return numerator[k] << (exponent - unit); }
};

template <int D>
std::array<PlaneSource<D>, D> SourcesOf(const Polytope<D>& cell, const CellNode<D>& node) {
  std::array<PlaneSource<D>, D> sources;
  for (int k = 0; k < D; ++k) {
    sources[k] = cell.plane(node.planes[k]).source;
  }
  return sources;
}

}  // namespace

template <int D>
bool DoMeet(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes) {
  return MeetingPoint<D>(site, planes).denominator != 0;
}

template <int D>
::testing::AssertionResult IsMeetingPointTo(int bits, const Point<D>& site, const std::array<PlaneSource<D>, D>& planes,
                                            const Point<D>& x) {
  const MeetingPoint<D> exact(site, planes);
  if (exact.denominator == 0) {
    return ::testing::AssertionFailure() << "the planes do not meet in one point";
  }
  const int unit = exact.UnitWith({x.begin(), x.end()});
  for (int k = 0; k < D; ++k) {
    if (!std::isfinite(x[k])) {
      return ::testing::AssertionFailure() << "coordinate " << k << " is " << x[k];
    }
    const cpp_int numerator = exact.NumeratorInUnits(k, unit);
    const cpp_int gap = InUnits(x[k], unit) * exact.denominator - numerator;
    if (cpp_int(abs(gap) << bits) > abs(numerator)) {
      return ::testing::AssertionFailure()
             << "coordinate " << k << ", " << x[k] << ", is not right to " << bits << " bits";
    }
  }
  return ::testing::AssertionSuccess();
}

template <int D>
::testing::AssertionResult HasNodesWithinSlack(const Polytope<D>& cell) {
  for (const CellNode<D>& node : cell.nodes()) {
    const MeetingPoint<D> exact(cell.site(), SourcesOf<D>(cell, node));
    if (exact.denominator == 0) {
      return ::testing::AssertionFailure() << "the planes of " << ::testing::PrintToString(node.x) << " do not meet";
    }
    if (!std::isfinite(core::NormSq<D>(node.x) + node.slack + node.reach)) {
      return ::testing::AssertionFailure()
             << ::testing::PrintToString(node.x) << " with slack " << node.slack << " and reach " << node.reach;
    }
    std::vector<double> values(node.x.begin(), node.x.end());
    values.insert(values.end(), {node.slack, node.reach});
    const int unit = exact.UnitWith(values);
    cpp_int gap_sq = 0;
    cpp_int radius_sq = 0;
    for (int k = 0; k < D; ++k) {
      const cpp_int numerator = exact.NumeratorInUnits(k, unit);
      const cpp_int gap = InUnits(node.x[k], unit) * exact.denominator - numerator;
      gap_sq += gap * gap;
      radius_sq += numerator * numerator;
    }
    const cpp_int slack = InUnits(node.slack, unit) * exact.denominator;
    if (gap_sq > slack * slack) {
      return ::testing::AssertionFailure() << ::testing::PrintToString(node.x)
                                           << " is farther from where its planes meet than its slack, " << node.slack;
    }
    const cpp_int reach = InUnits(node.reach, unit) * exact.denominator;
    if (radius_sq > reach * reach) {
      return ::testing::AssertionFailure()
             << ::testing::PrintToString(node.x) << " is farther away than its reach, " << node.reach;
    }
  }
  return ::testing::AssertionSuccess();
}

#define WELLSPACE_INSTANTIATE(D)                                                                                      \
  template bool DoMeet<D>(const Point<D>&, const std::array<PlaneSource<D>, D>&);                                     \
  template ::testing::AssertionResult IsMeetingPointTo<D>(int, const Point<D>&, const std::array<PlaneSource<D>, D>&, \
                                                          const Point<D>&);                                           \
  template ::testing::AssertionResult HasNodesWithinSlack<D>(const Polytope<D>&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::test
