// The stages of DecideCut: which one decides, where each ends, and that all agree.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/geometry/exact_measure.h"
#include "core/geometry/power_predicate.h"
#include "tests/core/geometry/decided_points.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

template <typename T>
class PredicateStagesTest : public test::SeededTest {
 protected:
  PredicateStagesTest() : SeededTest(2008) {}
};
TYPED_TEST_SUITE(PredicateStagesTest, test::AllDimensions);

// The bits of differences that one word serves.
template <int D>
constexpr int kWordBits = std::array{29, 19, 13, 10, 8}[D - 2];

TYPED_TEST(PredicateStagesTest, StageIsTheCheapestThatServes) {
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
TYPED_TEST(PredicateStagesTest, AWallWhosePlaceDoesNotMatterNeedsNoBits) {
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
TYPED_TEST(PredicateStagesTest, StagesEndAtTheirBits) {
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
TYPED_TEST(PredicateStagesTest, IntegerStagesDoNotOverflowAtTheirLimits) {
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
TYPED_TEST(PredicateStagesTest, StagesAgree) {
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

TYPED_TEST(PredicateStagesTest, DecidesSubnormalAndHugeCoordinates) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 100; ++i) {
    Decided<D> p = Draw<D>(Inputs::kLargeGrid, this->random_);
    const Sign expected = SignByInSphere<D>(p);
    EXPECT_EQ(Decide<D>(Scaled<D>(p, std::numeric_limits<double>::denorm_min()), TieRule::kKeep).sign, expected);
    EXPECT_EQ(Decide<D>(Scaled<D>(p, 0x1p1010), TieRule::kKeep).sign, expected);
  }
}

}  // namespace
}  // namespace wellspace::core
