// No point that is in a ball is said to be in none.
#include "core/refine/space/subsegment_balls.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

class SubsegmentBallsTest : public test::SeededTest {
 protected:
  SubsegmentBallsTest() : SeededTest(20261203) {}

  Point<3> Random() { return {random_.Unit(), random_.Unit(), random_.Unit()}; }
};

TEST_F(SubsegmentBallsTest, HoldWhatIsInOneOfThem) {
  SubsegmentBalls balls;
  balls.Begin();
  std::vector<std::array<Point<3>, 2>> ends;
  int held = 0;
  int looks = 0;
  for (int i = 0; i < 500; ++i) {
    const Point<3> a = Random();
    Point<3> b = a;
    for (double& x : b) {
      x += 0.05 * (random_.Unit() - 0.5);
    }
    balls.Add(a, b);
    ends.push_back({a, b});
    for (int k = 0; k < 20; ++k, ++looks) {
      const Point<3> p = Random();
      const bool is_in_one = std::any_of(ends.begin(), ends.end(), [&](const std::array<Point<3>, 2>& of) {
        return DistanceSq<3>(p, Between(of[0], of[1], 0.5)) <= 0.25 * DistanceSq<3>(of[0], of[1]);
      });
      EXPECT_TRUE(balls.MayHold(p) || !is_in_one);
      held += balls.MayHold(p) ? 1 : 0;
    }
    EXPECT_TRUE(balls.MayHold(a));
    EXPECT_TRUE(balls.MayHold(ends[i / 2][1]));
  }
  EXPECT_LT(held, looks / 10);
}

TEST_F(SubsegmentBallsTest, NothingIsSureUntilAllAreKnown) {
  SubsegmentBalls balls;
  EXPECT_TRUE(balls.MayHold({0, 0, 0}));
  balls.Add({0, 0, 0}, {1, 0, 0});
  balls.Begin();
  EXPECT_FALSE(balls.MayHold({0.5, 0, 0}));
  balls.Add({2, 0, 0}, {3, 0, 0});
  EXPECT_TRUE(balls.MayHold({2.5, 0, 0}));
  EXPECT_FALSE(balls.MayHold({1.5, 0, 0}));
  balls.Forget();
  EXPECT_TRUE(balls.MayHold({1.5, 0, 0}));
}

}  // namespace
}  // namespace wellspace::core
