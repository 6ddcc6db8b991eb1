// The work for a vertex does not grow with the input: counters at sizes of every run.
#include "tests/core/growth.h"

#include <gtest/gtest.h>

#include <array>

namespace wellspace::test {
namespace {

constexpr std::array<size_t, 2> kSizes = {1000, 10000};

TEST(GrowthTest, Uniform2) { ExpectConstantWork("uniform", 2, kSizes); }
TEST(GrowthTest, Uniform3) { ExpectConstantWork("uniform", 3, kSizes); }
TEST(GrowthTest, Clusters3) { ExpectConstantWork("clusters", 3, kSizes); }
// The Delaunay triangulation of the points alone is quadratic.
TEST(GrowthTest, Skew3) { ExpectConstantWork("skew", 3, kSizes); }

TEST(GrowthTest, RandomSegments) { ExpectConstantWorkInDomains("random", kSizes); }
TEST(GrowthTest, Coast) { ExpectConstantWorkInDomains("coast", kSizes); }
// Vertices far away see the hole, whose inside no scan may cross.
TEST(GrowthTest, HoleInABox) { ExpectConstantWorkInDomains("hole", std::array<size_t, 3>{100, 1000, 10000}); }

}  // namespace
}  // namespace wellspace::test
