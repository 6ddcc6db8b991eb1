// The laws of DecideCut, against exact_measure, integers of any size and concrete weights.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "core/geometry/power_predicate.h"
#include "tests/core/geometry/decided_points.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::IntegerPoint;
using test::SplitMix64;
using test::ToPoint;

template <typename T>
class PredicateTest : public test::SeededTest {
 protected:
  PredicateTest() : SeededTest(2008) {}
};
TYPED_TEST_SUITE(PredicateTest, test::AllDimensions);

TYPED_TEST(PredicateTest, AgreesWithInSphere) {
  constexpr int D = TypeParam::kValue;
  for (const Inputs inputs : kAllInputs) {
    int zeros = 0;
    for (int i = 0; i < 500; ++i) {
      const Decided<D> p = Draw<D>(inputs, this->random_);
      const ExactDecision decision = Decide<D>(p, TieRule::kKeep);
      ASSERT_EQ(decision.sign, SignByInSphere<D>(p)) << ::testing::PrintToString(p);
      ASSERT_FALSE(decision.perturbed);
      zeros += decision.sign == Sign::kZero ? 1 : 0;
    }
    if (D <= 4 && (inputs == Inputs::kSmallGrid || inputs == Inputs::kOneUlpApart)) {
      EXPECT_GT(zeros, D <= 3 ? 20 : 0) << "these inputs ought to be degenerate";
    }
  }
}

TYPED_TEST(PredicateTest, KeepsWhatIsExactlyCosphericalAndPerturbsNothingElse) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 300; ++i) {
    Decided<D> p = DrawCubeCorners<D>(this->random_);
    EXPECT_EQ(Decide<D>(p, TieRule::kKeep).sign, Sign::kZero);
    EXPECT_TRUE(Decide<D>(p, TieRule::kPerturb).perturbed);
    // One step of the last bit away it is none any more, and both rules say the same.
    double& x = p[D + 1][this->random_.Below(D)];
    x = std::nextafter(x, this->random_.Below(2) == 0 ? -1e9 : 1e9);
    const ExactDecision kept = Decide<D>(p, TieRule::kKeep);
    const ExactDecision perturbed = Decide<D>(p, TieRule::kPerturb);
    EXPECT_NE(kept.sign, Sign::kZero);
    EXPECT_EQ(perturbed.sign, kept.sign);
    EXPECT_FALSE(perturbed.perturbed);
  }
}

// Law (1).
TYPED_TEST(PredicateTest, DoesNotDependOnTheOrderOfPlanes) {
  constexpr int D = TypeParam::kValue;
  for (const Inputs inputs : kAllInputs) {
    for (int i = 0; i < 100; ++i) {
      const Decided<D> p = i % 2 == 0 ? Draw<D>(inputs, this->random_) : DrawCubeCorners<D>(this->random_);
      for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
        const Sign expected = Decide<D>(p, rule).sign;
        std::array<int, D> order;
        std::iota(order.begin(), order.end(), 1);
        // All of them, up to 4-D; then some.
        for (int k = 0; k < 23 && std::next_permutation(order.begin(), order.end()); ++k) {
          if (D > 4) {
            std::rotate(order.begin(), order.begin() + 1 + static_cast<int>(this->random_.Below(D)), order.end());
          }
          Decided<D> reordered = p;
          for (int j = 0; j < D; ++j) {
            reordered[j + 1] = p[order[j]];
          }
          ASSERT_EQ(Decide<D>(reordered, rule).sign, expected) << ::testing::PrintToString(p);
        }
      }
    }
  }
}

// Law (2).
TYPED_TEST(PredicateTest, DoesNotDependOnScaleAndPlace) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 300; ++i) {
    const Decided<D> p = i % 2 == 0 ? Draw<D>(Inputs::kLargeGrid, this->random_) : DrawCubeCorners<D>(this->random_);
    Point<D> by;
    for (double& x : by) {
      x = static_cast<double>(this->random_.Below(1 << 20)) * 0x1p20;
    }
    for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
      const Sign expected = Decide<D>(p, rule).sign;
      for (const int exponent : {-1022, -60, 60, 1000}) {
        ASSERT_EQ(Decide<D>(Scaled<D>(p, std::ldexp(1.0, exponent)), rule).sign, expected) << "2^" << exponent;
      }
      ASSERT_EQ(Decide<D>(Translated<D>(p, by), rule).sign, expected) << ::testing::PrintToString(by);
    }
  }
}

// Law (3).
TYPED_TEST(PredicateTest, PerturbationNeverLeavesATie) {
  constexpr int D = TypeParam::kValue;
  for (const Inputs inputs : kAllInputs) {
    for (int i = 0; i < 300; ++i) {
      const ExactDecision decision = Decide<D>(Draw<D>(inputs, this->random_), TieRule::kPerturb);
      ASSERT_NE(decision.sign, Sign::kZero);
    }
  }
}

TYPED_TEST(PredicateTest, NegativeZeroIsZero) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 100; ++i) {
    const Decided<D> p = DrawCubeCorners<D>(this->random_);
    Decided<D> negative = p;
    for (Point<D>& point : negative) {
      for (double& x : point) {
        x = x == 0 ? -0.0 : x;
      }
    }
    EXPECT_EQ(Decide<D>(negative, TieRule::kPerturb).sign, Decide<D>(p, TieRule::kPerturb).sign);
  }
}

// DecidePowerCut against InPowerSphere, which shares no arithmetic with it; whole weights make for ties.
TYPED_TEST(PredicateTest, WeightsCountAsPowers) {
  constexpr int D = TypeParam::kValue;
  int ties = 0;
  for (const Inputs inputs : kAllInputs) {
    for (int i = 0; i < 300; ++i) {
      const Decided<D> p = Draw<D>(inputs, this->random_);
      double least_sq = std::numeric_limits<double>::infinity();
      for (size_t a = 0; a < p.size(); ++a) {
        for (size_t b = 0; b < a; ++b) {
          least_sq = std::min(least_sq, DistanceSq<D>(p[a], p[b]));
        }
      }
      const bool is_exact = inputs == Inputs::kSmallGrid || inputs == Inputs::kLargeGrid;  // least_sq
      std::array<double, D + 2> weights;
      for (double& weight : weights) {
        weight = i % 2 == 0 && is_exact
                     ? least_sq * static_cast<double>(this->random_.Below(2))
                     : static_cast<float>(least_sq) * 0.999F * static_cast<float>(this->random_.Unit());
      }
      DecisionWeights<D> decision_weights{.site = weights[0], .generators = {}, .u = weights[D + 1]};
      std::copy_n(weights.begin() + 1, D, decision_weights.generators.begin());
      std::array<double, D + 1> simplex_weights;
      std::copy_n(weights.begin(), D + 1, simplex_weights.begin());
      const Sign expected = InPowerSphere<D>(SimplexOf<D>(p), simplex_weights, p[D + 1], weights[D + 1]).sign *
                            Orientation<D>(SimplexOf<D>(p)).sign;
      const auto decide = [&](TieRule rule) {
        return DecidePowerCut<D>(p[0], BisectorsOf<D>(p), p[D + 1], decision_weights, rule).sign;
      };
      ASSERT_EQ(decide(TieRule::kKeep), expected) << ::testing::PrintToString(p) << ::testing::PrintToString(weights);
      ASSERT_NE(decide(TieRule::kPerturb), Sign::kZero);
      if (expected != Sign::kZero) {
        ASSERT_EQ(decide(TieRule::kPerturb), expected);
      } else {
        ++ties;
      }
    }
  }
  EXPECT_GT(ties, D <= 4 ? 5 : 0);
}

// Equal weights are none.
TYPED_TEST(PredicateTest, EqualWeightsChangeNothing) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 300; ++i) {
    const Decided<D> p = Draw<D>(Inputs::kSmallGrid, this->random_);
    DecisionWeights<D> weights{.site = 0.75, .generators = {}, .u = 0.75};
    weights.generators.fill(0.75);
    for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
      ASSERT_EQ(DecidePowerCut<D>(p[0], BisectorsOf<D>(p), p[D + 1], weights, rule).sign, Decide<D>(p, rule).sign);
    }
  }
}

// A wall at `coordinate` bounds the cell as does the bisector with the site's mirror image beyond it.
TYPED_TEST(PredicateTest, AWallIsTheBisectorWithTheMirrorImage) {
  constexpr int D = TypeParam::kValue;
  int walls = 0;
  for (const Inputs inputs : {Inputs::kSmallGrid, Inputs::kLargeGrid, Inputs::kOneUlpApart}) {
    for (int i = 0; i < 300; ++i) {
      Decided<D> p = Draw<D>(inputs, this->random_);
      Planes<D> planes = BisectorsOf<D>(p);
      const int count = static_cast<int>(this->random_.Below(D)) + 1;
      for (int j = 0; j < count; ++j) {
        const int axis = (j + i) % D;
        planes[j] = PlaneSource<D>{.generator = {}, .coordinate = p[j + 1][axis], .axis = axis};
        Point<D> mirrored = p[0];
        mirrored[axis] += 2 * (p[j + 1][axis] - p[0][axis]);
        p[j + 1] = mirrored;
      }
      if (!IsDecidable<D>(p)) {
        continue;  // a wall through the site, or parallel planes
      }
      ++walls;
      ASSERT_EQ(DecideCut<D>(p[0], planes, p[D + 1], TieRule::kKeep).sign, SignByInSphere<D>(p))
          << ::testing::PrintToString(p);
    }
  }
  EXPECT_GT(walls, 200);
}

// The perturbation as defined: the vertices' weights are powers of one small number. Walls through the site included.
TYPED_TEST(PredicateTest, PerturbationIsThatOfSmallWeights) {
  constexpr int D = TypeParam::kValue;
  IntegerPoint<D> low;
  IntegerPoint<D> high;
  int perturbed = 0;
  for (int i = 0; i < 4000; ++i) {
    // From 4-D on ties are rare but among the corners of a cube.
    const int64_t range = D == 2 ? 5 : D == 3 || i % 2 == 0 ? 3 : 2;
    low.fill(0);
    high.fill(range - 1);
    std::vector<IntegerPoint<D>> points(D + 2);
    Decided<D> p;
    for (int k = 0; k < D + 2; ++k) {
      for (int64_t& x : points[k]) {
        x = static_cast<int64_t>(this->random_.Below(range));
      }
      p[k] = ToPoint<D>(points[k]);
    }
    if (!AreDistinct<D>(p)) {
      continue;
    }
    Planes<D> planes = BisectorsOf<D>(p);
    std::array<size_t, D> numbers;
    for (size_t j = 0; j < D; ++j) {
      numbers[j] = j + 1;
      if (this->random_.Below(3) == 0) {
        const size_t face = this->random_.Below(2 * D);
        const int axis = static_cast<int>(face / 2);
        numbers[j] = points.size() + face;
        planes[j] = {.generator = {}, .coordinate = face % 2 == 0 ? 0.0 : static_cast<double>(range - 1), .axis = axis};
      }
    }
    for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
      const std::optional<Sign> expected =
          test::ExactSide<D>(points, 0, numbers, D + 1, low, high, rule == TieRule::kPerturb);
      if (expected.has_value()) {
        const ExactDecision decision = DecideCut<D>(p[0], planes, p[D + 1], rule);
        ASSERT_EQ(decision.sign, *expected) << ::testing::PrintToString(p) << ::testing::PrintToString(numbers);
        perturbed += decision.perturbed ? 1 : 0;
      }
    }
  }
  EXPECT_GT(perturbed, 40);
}

// All sites see one triangulation of cospherical points: a simplex is in it for all its corners or for none, and the
// simplices fill the hull, which all simplices of D + 2 points together cover twice.
TYPED_TEST(PredicateTest, PerturbationIsTheSameFromEverySite) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 200; ++i) {
    const Decided<D> p = DrawCubeCorners<D>(this->random_);
    ExactVolumeSum<D> kept_minus_rest;
    for (int left_out = 0; left_out < D + 2; ++left_out) {
      Decided<D> roles = p;
      std::swap(roles[left_out], roles[D + 1]);
      const Sign orientation = Orientation<D>(SimplexOf<D>(roles)).sign;
      if (orientation == Sign::kZero) {
        continue;
      }
      const Sign sign = Decide<D>(roles, TieRule::kPerturb).sign;
      for (int site = 1; site <= D; ++site) {
        std::rotate(roles.begin(), roles.begin() + 1, roles.begin() + D + 1);
        ASSERT_EQ(Decide<D>(roles, TieRule::kPerturb).sign, sign) << ::testing::PrintToString(roles);
      }
      Simplex<D> simplex = SimplexOf<D>(roles);
      if ((Orientation<D>(simplex).sign == Sign::kNegative) != (sign == Sign::kPositive)) {
        std::swap(simplex[0], simplex[1]);
      }
      kept_minus_rest.Add(simplex);
    }
    ASSERT_EQ(kept_minus_rest.sign(), Sign::kZero) << ::testing::PrintToString(p);
  }
}

// a * a - b, compiled for a machine that could fuse it, where there is such a choice.
#if defined(__x86_64__)
__attribute__((target("fma")))
#endif
double
SquareMinus(double a, double b) {
  return a * a - b;
}

bool CanFuse() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("fma") != 0;
#else
  return true;
#endif
}

// With a = 1 + 2^-30, a * a rounds 2^-60 away: fused, a * a - b would find it, two roundings give zero. Checks that
// compare computed products must be compiled without contraction.
TEST(FloatingPoint, ProductsAreNotFusedIntoSums) {
  if (!CanFuse()) {
    GTEST_SKIP() << "this processor has no fused multiply-add";
  }
  volatile double source = 1 + 0x1p-30;
  const double a = source;
  const double rounded = source * source;
  EXPECT_EQ(SquareMinus(a, rounded), 0);
  EXPECT_EQ(std::fma(a, a, -rounded), 0x1p-60);
}

}  // namespace
}  // namespace wellspace::core
