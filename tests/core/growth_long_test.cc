// The work for a vertex does not grow with the input: counters at the largest sizes.
#include <gtest/gtest.h>

#include <array>

#include "tests/core/growth.h"

namespace wellspace::test {
namespace {

constexpr std::array<size_t, 3> kSizes = {1000, 100000, 1000000};

TEST(GrowthLongTest, Uniform2) { ExpectConstantWork("uniform", 2, kSizes); }
TEST(GrowthLongTest, Uniform3) { ExpectConstantWork("uniform", 3, kSizes); }
TEST(GrowthLongTest, Clusters3) { ExpectConstantWork("clusters", 3, kSizes); }
// The Delaunay triangulation of the points alone is quadratic: 2.5 * 10^11 simplices for 10^6 of them.
TEST(GrowthLongTest, Skew3) { ExpectConstantWork("skew", 3, kSizes); }

TEST(GrowthLongTest, RandomSegments) { ExpectConstantWorkInDomains("random", kSizes); }
TEST(GrowthLongTest, Coast) { ExpectConstantWorkInDomains("coast", kSizes); }

}  // namespace
}  // namespace wellspace::test
