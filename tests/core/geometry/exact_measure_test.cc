// Signs and volumes against integers of many bits, in all dimensions and at all scales.
#include "core/geometry/exact_measure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/support/bareiss.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"

namespace wellspace::core {
namespace {

using test::Seed;
using test::SplitMix64;

using boost::multiprecision::cpp_int;

template <int D>
using IntegerPoint = std::array<int64_t, D>;

Sign SignOf(const cpp_int& value) { return static_cast<Sign>(value.sign()); }

// The oracles: homogeneous coordinates in place of differences, elimination in place of expansion.
template <int D>
Sign OracleOrientation(const std::array<IntegerPoint<D>, D + 1>& p) {
  std::array<std::array<cpp_int, D + 1>, D + 1> m;
  for (int i = 0; i <= D; ++i) {
    m[i][0] = 1;
    std::copy(p[i].begin(), p[i].end(), m[i].begin() + 1);
  }
  return SignOf(test::BareissDeterminant<D + 1>(m));
}

template <int D>
Sign OracleInSphere(const std::array<IntegerPoint<D>, D + 1>& p, const IntegerPoint<D>& q,
                    const std::array<int64_t, D + 2>& weights = {}) {
  std::array<std::array<cpp_int, D + 2>, D + 2> m;
  for (int i = 0; i <= D + 1; ++i) {
    const IntegerPoint<D>& point = i <= D ? p[i] : q;
    m[i][0] = 1;
    std::copy(point.begin(), point.end(), m[i].begin() + 1);
    m[i][D + 1] = -weights[i];
    for (const int64_t x : point) {
      m[i][D + 1] += cpp_int(x) * x;
    }
  }
  // Negative for the centre of a simplex of positive orientation, in every dimension.
  return -SignOf(test::BareissDeterminant<D + 2>(m));
}

template <int D>
constexpr int kFactorial = D* kFactorial<D - 1>;
template <>
constexpr int kFactorial<1> = 1;

template <int D>
Point<D> ToPoint(const IntegerPoint<D>& p, double scale) {
  Point<D> out;
  for (int k = 0; k < D; ++k) {
    out[k] = static_cast<double>(p[k]) * scale;
  }
  return out;
}

template <typename T>
class ExactMeasureTest : public ::testing::Test {};
TYPED_TEST_SUITE(ExactMeasureTest, test::AllDimensions);

struct Draw {
  int64_t range;
  double scale;
};

// Small ranges are full of exact zeros, large ones nearly never degenerate; the scales are at both ends of the doubles.
TYPED_TEST(ExactMeasureTest, SignsAgreeWithIntegerOracle) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = Seed(1);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (const Draw draw :
       {Draw{2, 1}, Draw{5, 0x1p-30}, Draw{100, 0x1p500}, Draw{1 << 20, 0x1p-520}, Draw{1 << 20, 0x1p-1060}}) {
    int zeros = 0;
    for (int round = 0; round < 4000 / D; ++round) {
      std::array<IntegerPoint<D>, D + 1> integers;
      IntegerPoint<D> q;
      const auto next = [&] { return static_cast<int64_t>(random.Below(2 * draw.range + 1)) - draw.range; };
      Simplex<D> simplex;
      for (int i = 0; i <= D; ++i) {
        for (int64_t& x : integers[i]) {
          x = next();
        }
        simplex[i] = ToPoint<D>(integers[i], draw.scale);
      }
      for (int64_t& x : q) {
        x = next();
      }
      const Sign orientation = OracleOrientation<D>(integers);
      ASSERT_EQ(Orientation<D>(simplex).sign, orientation) << "range " << draw.range << ", round " << round;
      const MeasuredSign in_sphere = InSphere<D>(simplex, ToPoint<D>(q, draw.scale));
      ASSERT_EQ(in_sphere.sign, OracleInSphere<D>(integers, q)) << "range " << draw.range << ", round " << round;
      if (draw.scale == 1) {
        std::array<int64_t, D + 2> weights;
        std::generate(weights.begin(), weights.end(), [&] { return static_cast<int64_t>(random.Below(4)); });
        std::array<double, D + 1> of_simplex;
        std::copy_n(weights.begin(), D + 1, of_simplex.begin());
        const Sign power =
            InPowerSphere<D>(simplex, of_simplex, ToPoint<D>(q, 1), static_cast<double>(weights[D + 1])).sign;
        ASSERT_EQ(power, OracleInSphere<D>(integers, q, weights)) << "range " << draw.range << ", round " << round;
      }
      if (in_sphere.sign == Sign::kZero) {
        ++zeros;
        EXPECT_EQ(in_sphere.stage, Stage::kBigInteger);
      }
    }
    if (draw.range == 2) {
      EXPECT_GT(zeros, 0);
    } else if (draw.range > 5) {
      EXPECT_EQ(zeros, 0) << "range " << draw.range;
    }
  }
}

TYPED_TEST(ExactMeasureTest, FilterDecidesRandomPointsAtEveryScale) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = Seed(2);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (const double scale : {1.0, 1e-150, 1e150, 1e-300, 1e300}) {
    int exact = 0;
    for (int round = 0; round < 2000 / D; ++round) {
      Simplex<D> simplex;
      Point<D> q;
      for (Point<D>& p : simplex) {
        for (double& x : p) {
          x = scale * random.Unit();
        }
      }
      for (double& x : q) {
        x = scale * random.Unit();
      }
      exact += Orientation<D>(simplex).stage == Stage::kFilter ? 0 : 1;
      exact += InSphere<D>(simplex, q).stage == Stage::kFilter ? 0 : 1;
    }
    EXPECT_EQ(exact, 0) << "scale " << scale;
  }
}

TYPED_TEST(ExactMeasureTest, ExchangesNegateTheSigns) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = Seed(3);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (int round = 0; round < 2000 / D; ++round) {
    // Coordinates over 40 binades, so that both stages are taken.
    const auto next = [&] { return std::scalbn(random.Unit() - 0.5, -static_cast<int>(random.Below(40))); };
    Simplex<D> simplex;
    Point<D> q;
    for (Point<D>& p : simplex) {
      for (double& x : p) {
        x = next();
      }
    }
    for (double& x : q) {
      x = next();
    }
    const Sign orientation = Orientation<D>(simplex).sign;
    const Sign in_sphere = InSphere<D>(simplex, q).sign;
    Simplex<D> exchanged = simplex;
    std::swap(exchanged[0], exchanged[D]);
    EXPECT_EQ(Orientation<D>(exchanged).sign, -orientation);
    EXPECT_EQ(InSphere<D>(exchanged, q).sign, -in_sphere);
    Simplex<D> with_q = simplex;
    std::swap(with_q[1], q);
    EXPECT_EQ(InSphere<D>(with_q, q).sign, -in_sphere);
  }
}

TYPED_TEST(ExactMeasureTest, CentreIsInsideAndFarPointOutside) {
  constexpr int D = TypeParam::kValue;
  Simplex<D> simplex{};
  Point<D> centre;
  Point<D> far;
  for (int i = 0; i < D; ++i) {
    simplex[i + 1][i] = 1;
    centre[i] = 0.5;
    far[i] = 2;
  }
  EXPECT_EQ(Orientation<D>(simplex).sign, Sign::kPositive);
  EXPECT_EQ(InSphere<D>(simplex, centre).sign, Sign::kPositive);
  EXPECT_EQ(InSphere<D>(simplex, far).sign, Sign::kNegative);
  for (double& x : far) {
    x = 1;
  }
  const MeasuredSign opposite_corner = InSphere<D>(simplex, far);
  EXPECT_EQ(opposite_corner.sign, Sign::kZero);
  EXPECT_EQ(opposite_corner.stage, Stage::kBigInteger);
  far[0] = std::nextafter(1.0, 2.0);
  EXPECT_EQ(InSphere<D>(simplex, far).sign, Sign::kNegative);
  far[0] = std::nextafter(1.0, 0.0);
  EXPECT_EQ(InSphere<D>(simplex, far).sign, Sign::kPositive);
}

// Kettner et al., "Classroom examples of robustness problems in geometric computations": a point walks ulp by ulp about
// a line.
TEST(OrientationTest, UlpsAboutALine) {
  int exact = 0;
  for (int i = 0; i < 64; ++i) {
    for (int j = 0; j < 64; ++j) {
      const MeasuredSign side =
          Orientation<2>({Point<2>{0.5 + i * 0x1p-53, 0.5 + j * 0x1p-53}, Point<2>{12, 12}, Point<2>{24, 24}});
      EXPECT_EQ(side.sign, SignOf(cpp_int(j) - i)) << i << ", " << j;
      exact += side.stage == Stage::kBigInteger ? 1 : 0;
    }
  }
  EXPECT_GE(exact, 64);
}

TEST(OrientationTest, CoordinatesFarApartInScale) {
  // b - a = (1e300, 1e-300), c - a = (2e300, 2e-300 + one ulp): the determinant's terms agree in all but the last bit.
  const double small = 1e-300;
  const double twice = std::nextafter(2 * small, 1.0);
  const MeasuredSign side = Orientation<2>({Point<2>{0, 0}, Point<2>{1e300, small}, Point<2>{2e300, twice}});
  EXPECT_EQ(side.sign, Sign::kPositive);
  EXPECT_EQ(side.stage, Stage::kBigInteger);
  EXPECT_EQ(Orientation<2>({Point<2>{0, 0}, Point<2>{1e300, small}, Point<2>{2e300, 2 * small}}).sign, Sign::kZero);
}

TYPED_TEST(ExactMeasureTest, VolumesCancelToTheLastBit) {
  constexpr int D = TypeParam::kValue;
  // A corner simplex of a box has the D!-th part of its volume; D! of them leave nothing.
  Simplex<D> simplex{};
  Box<D> box;
  for (int k = 0; k < D; ++k) {
    const double corner = 1e6 + 0.1 * k;
    for (int i = 0; i <= D; ++i) {
      simplex[i][k] = corner;
    }
    box.low[k] = corner;
    box.high[k] = std::nextafter(2e6, 3e6);
    simplex[k + 1][k] = box.high[k];
  }
  ExactVolumeSum<D> sum;
  sum.Subtract(box);
  for (int i = 0; i < kFactorial<D>; ++i) {
    EXPECT_EQ(sum.sign(), Sign::kNegative) << "after " << i << " simplices";
    sum.Add(simplex);
  }
  EXPECT_EQ(sum.sign(), Sign::kZero);
  EXPECT_EQ(sum.value(), 0);

  Simplex<D> tiny{};
  for (int i = 0; i < D; ++i) {
    tiny[i + 1][i] = 0x1p-1074;
  }
  sum.Add(tiny);
  EXPECT_EQ(sum.sign(), Sign::kPositive);
  std::swap(tiny[0], tiny[1]);
  sum.Add(tiny);
  EXPECT_EQ(sum.sign(), Sign::kZero);
}

TYPED_TEST(ExactMeasureTest, VolumeValue) {
  constexpr int D = TypeParam::kValue;
  Simplex<D> simplex{};
  for (int i = 0; i < D; ++i) {
    simplex[i + 1][i] = 3;
  }
  ExactVolumeSum<D> sum;
  sum.Add(simplex);
  const double volume = std::pow(3.0, D) / kFactorial<D>;
  EXPECT_DOUBLE_EQ(sum.value(), volume);
  std::swap(simplex[0], simplex[1]);
  sum.Add(simplex);
  sum.Add(simplex);
  EXPECT_DOUBLE_EQ(sum.value(), -volume);
  // A coarse sum stays the same when a much finer term joins it.
  for (Point<D>& p : simplex) {
    for (double& x : p) {
      x *= 0x1p-100;
    }
  }
  sum.Add(simplex);
  EXPECT_DOUBLE_EQ(sum.value(), -volume);
}

TYPED_TEST(ExactMeasureTest, CircumcentreOffsets) {
  constexpr int D = TypeParam::kValue;
  for (const double scale : {1.0, 0x1p-500, 0x1p500}) {
    Simplex<D> simplex;
    for (Point<D>& p : simplex) {
      p.fill(scale * 1024);
    }
    for (int i = 0; i < D; ++i) {
      simplex[i + 1][i] += scale * (2 + 2 * i);
    }
    const Point<D> offset = ExactCircumcentreOffset<D>(simplex);
    for (int i = 0; i < D; ++i) {
      EXPECT_EQ(offset[i], scale * (1 + i));
    }
  }
  Simplex<D> flat{};
  for (int i = 0; i <= D; ++i) {
    flat[i].fill(i);
  }
  EXPECT_EQ(ExactCircumcentreOffset<D>(flat)[0], std::numeric_limits<double>::infinity());
}

TEST(ExactMeasure, ProductsThatUnderflowDoNotDecideInSpace) {
  // The last edge is so long that the part of the others' product that underflows counts more than the rest.
  const double tiny = 0x1p-540;
  for (const double tilt : {-0x1p-700, 0.0, 0x1p-700}) {
    const Simplex<3> simplex = {Point<3>{0, 0, 0}, Point<3>{tiny, 0, tilt}, Point<3>{0, tiny, 1},
                                Point<3>{1, 0, 0x1p1000}};
    // tiny^2 2^1000 - tiny tilt, of which the first is the larger by far.
    EXPECT_EQ(Orientation<3>(simplex).sign, Sign::kPositive) << tilt;
    EXPECT_EQ(Orientation<3>({simplex[0], simplex[2], simplex[1], simplex[3]}).sign, Sign::kNegative) << tilt;
  }
}

}  // namespace
}  // namespace wellspace::core
