// Points, and sizes at points, that are refused by the box of their session.
#include "server/sessions/session_box.h"

#include <limits>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "server/wire/errors.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const std::vector<double> kNone;
const std::vector<double> kLow = {0, 10};
const std::vector<double> kHigh = {1, 20};
const SessionBox kOpen{.low = kNone, .high = kNone};
const SessionBox kBox{.low = kLow, .high = kHigh};

TEST(SessionBox, ItsCornersAreWithin) {
  const std::vector<double> corners = {0, 10, 1, 20};
  EXPECT_TRUE(CheckPoints(kBox, 2, 0, corners).ok());
  EXPECT_TRUE(CheckSamples(kBox, 2, {.points = corners, .sizes = {1, 1}}).ok());
}

TEST(SessionBox, TheFirstCoordinateOutsideIsNamed) {
  const std::vector<double> outside = {0, 10, 0.5, 20.5, 7, 7};
  const absl::Status points = CheckPoints(kBox, 2, 40, outside);
  EXPECT_EQ(DetailsOf(points).reason, "INVALID_POINTS");
  EXPECT_EQ(points.message(), "points[41]: coordinate 1 is 20.5; in the domain it is from 10 to 20");
  const absl::Status samples = CheckSamples(kBox, 2, {.points = outside, .sizes = {1, 1, 1}});
  EXPECT_EQ(DetailsOf(samples).reason, "INVALID_SIZES");
  EXPECT_EQ(samples.message(), "samples.points[1]: coordinate 1 is 20.5; in the domain it is from 10 to 20");
}

TEST(SessionBox, NoNumberIsWithin) {
  for (const double x : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_FALSE(CheckPoints(kBox, 2, 0, std::vector<double>{x, 15}).ok()) << x;
    EXPECT_FALSE(CheckSamples(kBox, 2, {.points = {x, 15}, .sizes = {1}}).ok()) << x;
    EXPECT_EQ(CheckPoints(kOpen, 2, 0, std::vector<double>{15, x}).message().substr(0, 24), "points[0]: coordinate 1 ");
  }
}

TEST(SessionBox, AnOpenOneHasAllThatIsFinite) {
  EXPECT_TRUE(CheckPoints(kOpen, 2, 0, std::vector<double>{-1e300, 1e300}).ok());
  EXPECT_TRUE(CheckSamples(kOpen, 2, {.points = {-1e300, 1e300}, .sizes = {1}}).ok());
}

}  // namespace
}  // namespace wellspace::server
