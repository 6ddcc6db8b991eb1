// Values between vertices against a linear function; values of another mesh are refused.
#include "client/interpolate.h"

#include <cmath>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Two points in a mesh of four vertices in 2-D, and one in none.
Located Places() {
  return {.simplices = {1, 0, kNoSimplex},
          .vertices = {1, 2, 3, 0, 1, 2, 0, 0, 0},
          .coordinates = {0.5, 0.25, 0.25, 1, 0, 0, 0, 0, 0},
          .revision = 3,
          .vertex_count = 4};
}

TEST(Interpolate, IsLinearBetweenVertices) {
  const absl::StatusOr<std::vector<double>> found = Interpolate(Places(), std::vector<double>{8, 4, 2, 1});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ((*found)[0], 2.75);
  EXPECT_EQ((*found)[1], 8);
  EXPECT_TRUE(std::isnan((*found)[2]));
  const absl::StatusOr<std::vector<double>> pairs =
      Interpolate(Places(), std::vector<double>{8, 0, 4, 1, 2, 0, 1, 0}, {.width = 2, .revision = 3});
  ASSERT_TRUE(pairs.ok()) << pairs.status();
  EXPECT_EQ((*pairs)[0], 2.75);
  EXPECT_EQ((*pairs)[1], 0.5);
  Located none;
  none.vertex_count = 1;
  EXPECT_THAT(*Interpolate(none, std::vector<double>{7}), ElementsAre());
}

// A larger mesh has values for all vertices that are named, and they are of other ones.
TEST(Interpolate, RefusesTheValuesOfAnotherMesh) {
  for (const size_t count : {0, 3, 5, 8, 1000}) {
    const absl::Status status = Interpolate(Places(), std::vector<double>(count, 1)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << count;
    EXPECT_THAT(std::string(status.message()), HasSubstr("expected 1 for each of the 4 vertices"));
  }
  EXPECT_FALSE(Interpolate(Places(), std::vector<double>(4, 1), {.width = 2}).ok());
  EXPECT_FALSE(Interpolate(Places(), std::vector<double>(4, 1), {.width = 0}).ok());
  const absl::Status other = Interpolate(Places(), std::vector<double>(4, 1), {.revision = 2}).status();
  EXPECT_EQ(other.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(other.message()),
              HasSubstr("of revision 2, and the points were located in that of revision 3"));
}

}  // namespace
}  // namespace wellspace::client
