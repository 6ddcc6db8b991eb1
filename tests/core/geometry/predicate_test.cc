// The laws of DecideCut, against exact_measure, integers of any size and concrete weights.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "core/geometry/power_predicate.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::IntegerPoint;
using test::SplitMix64;
using test::ToPoint;

template <int D>
using Planes = std::array<PlaneSource<D>, D>;

// A site, the generators of D bisectors, and u.
template <int D>
using Decided = std::array<Point<D>, D + 2>;

template <int D>
Planes<D> BisectorsOf(const Decided<D>& p) {
  Planes<D> planes;
  for (int j = 0; j < D; ++j) {
    planes[j].generator = p[j + 1];
  }
  return planes;
}

template <int D>
ExactDecision Decide(const Decided<D>& p, TieRule rule) {
  return DecideCut<D>(p[0], BisectorsOf<D>(p), p[D + 1], rule);
}

template <int D>
Simplex<D> SimplexOf(const Decided<D>& p) {
  Simplex<D> simplex;
  std::copy_n(p.begin(), D + 1, simplex.begin());
  return simplex;
}

template <int D>
bool AreDistinct(Decided<D> p) {
  std::sort(p.begin(), p.end());
  return std::adjacent_find(p.begin(), p.end()) == p.end();
}

// Whether DecideCut's REQUIRES hold for any choice of a site.
template <int D>
bool IsDecidable(const Decided<D>& p) {
  return AreDistinct<D>(p) && Orientation<D>(SimplexOf<D>(p)).sign != Sign::kZero;
}

// The node is the circumcentre of the site and the generators: u cuts it off where it is inside their sphere.
template <int D>
Sign SignByInSphere(const Decided<D>& p) {
  return InSphere<D>(SimplexOf<D>(p), p[D + 1]).sign * Orientation<D>(SimplexOf<D>(p)).sign;
}

template <int D>
Decided<D> Scaled(Decided<D> p, double factor) {
  for (Point<D>& point : p) {
    for (double& x : point) {
      x *= factor;
    }
  }
  return p;
}

template <int D>
Decided<D> Translated(Decided<D> p, const Point<D>& by) {
  for (Point<D>& point : p) {
    for (int k = 0; k < D; ++k) {
      point[k] += by[k];
    }
  }
  return p;
}

// The inputs that the properties are checked on.
enum class Inputs { kSmallGrid, kLargeGrid, kUniform, kOneUlpApart, kLogUniform };
constexpr std::array kAllInputs = {Inputs::kSmallGrid, Inputs::kLargeGrid, Inputs::kUniform, Inputs::kOneUlpApart,
                                   Inputs::kLogUniform};

double DrawCoordinate(Inputs inputs, SplitMix64& random) {
  switch (inputs) {
    case Inputs::kSmallGrid:
      return static_cast<double>(random.Below(3));
    case Inputs::kLargeGrid:
      return static_cast<double>(random.Below(2000)) - 1000;
    case Inputs::kUniform:
      return random.Unit() - 0.25;
    case Inputs::kOneUlpApart:
      return 1 + static_cast<double>(random.Below(4)) * 0x1p-52;
    case Inputs::kLogUniform:
      return std::ldexp(random.Unit() - 0.5, -static_cast<int>(random.Below(250)));
  }
  return 0;
}

template <int D>
Decided<D> Draw(Inputs inputs, SplitMix64& random) {
  while (true) {
    Decided<D> p;
    for (Point<D>& point : p) {
      for (double& x : point) {
        x = DrawCoordinate(inputs, random);
      }
    }
    if (IsDecidable<D>(p)) {
      return p;
    }
  }
}

// D + 2 corners of a cube: cospherical, and any D + 1 that are not in a plane do for a simplex.
template <int D>
Decided<D> DrawCubeCorners(SplitMix64& random) {
  while (true) {
    Decided<D> p;
    const double side = static_cast<double>(1 + random.Below(8));
    for (Point<D>& point : p) {
      for (double& x : point) {
        x = random.Below(2) == 0 ? 0 : side;
      }
    }
    if (IsDecidable<D>(p)) {
      return p;
    }
  }
}

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

// The bits of differences that one word serves.
template <int D>
constexpr int kWordBits = std::array{29, 19, 13, 10, 8}[D - 2];

TYPED_TEST(PredicateTest, StageIsTheCheapestThatServes) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 100; ++i) {
    for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
      EXPECT_EQ(Decide<D>(Draw<D>(Inputs::kSmallGrid, this->random_), rule).stage, Stage::kWord);
      // A large grid, once as it is and once with a corner so far away that a word is too short.
      Decided<D> grid = Draw<D>(Inputs::kLargeGrid, this->random_);
      for (const bool is_wide : {false, true}) {
        if (is_wide) {
          grid[D + 1].fill(0x1p32);
        }
        const Stage stage = Decide<D>(grid, rule).stage;
        EXPECT_TRUE(stage == Stage::kInteger || (stage == Stage::kWord && !is_wide));
        for (const double scale : {0x1p-900, 0x1p900}) {
          EXPECT_EQ(Decide<D>(Scaled<D>(grid, scale), rule).stage, stage) << "the span of bits decides";
        }
        // Far from the origin, where only the differences have few bits.
        Point<D> far;
        far.fill(0x1p40);
        EXPECT_EQ(Decide<D>(Translated<D>(grid, far), rule).stage, stage);
      }
      EXPECT_EQ(Decide<D>(Draw<D>(Inputs::kUniform, this->random_), rule).stage, Stage::kInteger);
      EXPECT_NE(Decide<D>(Draw<D>(Inputs::kLogUniform, this->random_), rule).stage, Stage::kInteger);
    }
  }
}

// A wall at a place of many bits, and D - 1 bisectors: it matters unless that of u holds the line along which they
// meet.
TYPED_TEST(PredicateTest, AWallWhosePlaceDoesNotMatterNeedsNoBits) {
  constexpr int D = TypeParam::kValue;
  const auto unit = [](int axis) {
    Point<D> p{};
    p[axis] = 1;
    return p;
  };
  for (const double place : {1 + 0x1p-40, -1 - 0x1p-40, 0x1p-50}) {
    Planes<D> planes;
    Decided<D> p{};
    for (int j = 0; j < D - 1; ++j) {
      planes[j].generator = p[j + 1] = unit(j);
    }
    planes[D - 1] = {.generator = {}, .coordinate = place, .axis = D - 1};
    p[D][D - 1] = 2 * place;  // the mirror image of the site
    p[D + 1].fill(1);
    const ExactDecision other = DecideCut<D>(p[0], planes, p[D + 1], TieRule::kKeep);
    EXPECT_NE(other.stage, Stage::kWord);
    EXPECT_EQ(other.sign, SignByInSphere<D>(p));
    if (D == 2) {
      continue;  // no bisector holds the line of another
    }
    p[D + 1][D - 1] = 0;
    EXPECT_EQ(SignByInSphere<D>(p), Sign::kZero);
    for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
      const ExactDecision decision = DecideCut<D>(p[0], planes, p[D + 1], rule);
      EXPECT_EQ(decision.stage, Stage::kWord);
      planes[D - 1].coordinate = place < 0 ? -1 : 1;
      EXPECT_EQ(decision.sign, DecideCut<D>(p[0], planes, p[D + 1], rule).sign);
      planes[D - 1].coordinate = place;
    }
  }
}

// The corner of a cube, its site moved so that the largest difference is 2^(bits - 1) + 1 times the smallest.
TYPED_TEST(PredicateTest, StagesEndAtTheirBits) {
  constexpr int D = TypeParam::kValue;
  Decided<D> p{};
  for (int k = 0; k < D; ++k) {
    p[k + 1][k] = 1;
    p[D + 1][k] = 1;
  }
  for (const auto& [bits, stage] : {std::pair(kWordBits<D>, Stage::kWord), std::pair(kWordBits<D> + 1, Stage::kInteger),
                                    std::pair(62, Stage::kInteger), std::pair(63, Stage::kWideInteger),
                                    std::pair(126, Stage::kWideInteger), std::pair(127, Stage::kBigInteger)}) {
    p[0][D - 1] = -std::ldexp(1.0, 1 - bits);
    const ExactDecision decision = Decide<D>(p, TieRule::kKeep);
    EXPECT_EQ(decision.stage, stage) << bits;
    EXPECT_EQ(decision.sign, SignByInSphere<D>(p)) << bits;
    EXPECT_NE(decision.sign, Sign::kZero) << bits;
  }
}

// At the widest differences that an integer stage takes, the largest determinants must not wrap: corners of a cube with
// all bits set, and with the sign patterns of Hadamard's matrices among them.
TYPED_TEST(PredicateTest, IntegerStagesDoNotOverflowAtTheirLimits) {
  constexpr int D = TypeParam::kValue;
  std::array<int, 5> decided = {};
  for (const int limit : {kWordBits<D>, 62, 126}) {
    for (int bits = limit - 4; bits <= limit + 1; ++bits) {
      for (int i = 0; i < 200; ++i) {
        // Corners +-(2^(bits - 1) - 2^(bits - 54)), or -1 if the last is below one, and in one coordinate of the site
        // plus or minus one: so the differences have almost all `bits` bits.
        const double largest = std::ldexp(1, bits - 1) - std::max(1.0, std::ldexp(1, bits - 54));
        Decided<D> p;
        do {
          for (Point<D>& point : p) {
            for (double& x : point) {
              x = this->random_.Below(2) == 0 ? -largest : largest;
            }
          }
          p[0][this->random_.Below(D)] = this->random_.Below(2) == 0 ? -1 : 1;
        } while (!IsDecidable<D>(p));
        for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
          const ExactDecision decision = Decide<D>(p, rule);
          ASSERT_TRUE(decision.perturbed || decision.sign == SignByInSphere<D>(p))
              << bits << " bits: " << ::testing::PrintToString(p);
          ++decided[static_cast<size_t>(decision.stage)];
        }
        // Ties of the same size: law (2) has the expected answer.
        Decided<D> corners = DrawCubeCorners<D>(this->random_);
        const double side = *std::max_element(corners[1].begin(), corners[1].end());
        Decided<D> large = corners;
        for (Point<D>& point : large) {
          for (double& x : point) {
            x = x == 0 ? -largest : largest;
          }
        }
        if (side > 0) {
          ASSERT_EQ(Decide<D>(large, TieRule::kPerturb).sign, Decide<D>(corners, TieRule::kPerturb).sign)
              << ::testing::PrintToString(large);
        }
      }
    }
  }
  EXPECT_GT(decided[static_cast<size_t>(Stage::kWord)], 0);
  EXPECT_GT(decided[static_cast<size_t>(Stage::kInteger)], 0);
  EXPECT_GT(decided[static_cast<size_t>(Stage::kWideInteger)], 0);
  EXPECT_GT(decided[static_cast<size_t>(Stage::kBigInteger)], 0);
}

// Everything but a wall lies in the plane x[D - 1] = 0. Where the wall along that axis is does not matter then, but
// makes the span of bits.
TYPED_TEST(PredicateTest, StagesAgree) {
  constexpr int D = TypeParam::kValue;
  int perturbed = 0;
  for (int i = 0; i < 400; ++i) {
    Decided<D> p = i % 2 == 0 ? Draw<D>(Inputs::kSmallGrid, this->random_) : DrawCubeCorners<D>(this->random_);
    for (Point<D>& point : p) {
      point[D - 1] = 0;
    }
    p[D] = p[0];
    p[D][D - 1] = 1;  // a stand-in for the wall
    if (!IsDecidable<D>(p)) {
      continue;
    }
    Planes<D> planes = BisectorsOf<D>(p);
    for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
      const Sign expected = Decide<D>(p, rule).sign;
      for (const auto& [wall, stage] :
           {std::pair(1.0, Stage::kWord), std::pair(0x1p40, Stage::kInteger), std::pair(-0x1p61, Stage::kInteger),
            std::pair(0x1p100, Stage::kWideInteger), std::pair(0x1p200, Stage::kBigInteger)}) {
        planes[D - 1] = {.generator = {}, .coordinate = wall, .axis = D - 1};
        const ExactDecision decision = DecideCut<D>(p[0], planes, p[D + 1], rule);
        ASSERT_EQ(decision.stage, stage) << wall;
        ASSERT_EQ(decision.sign, expected) << wall << ' ' << ::testing::PrintToString(p);
        perturbed += decision.perturbed ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(perturbed > 0, D > 2) << "two points of a line have no third at the same distance";
}

TYPED_TEST(PredicateTest, DecidesSubnormalAndHugeCoordinates) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 100; ++i) {
    Decided<D> p = Draw<D>(Inputs::kLargeGrid, this->random_);
    const Sign expected = SignByInSphere<D>(p);
    EXPECT_EQ(Decide<D>(Scaled<D>(p, std::numeric_limits<double>::denorm_min()), TieRule::kKeep).sign, expected);
    EXPECT_EQ(Decide<D>(Scaled<D>(p, 0x1p1010), TieRule::kKeep).sign, expected);
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
