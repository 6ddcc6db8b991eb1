// The generators that the other tests rest on.
#include "tests/support/clouds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <set>

namespace wellspace::test {
namespace {

struct Expected {
  std::string_view kind;
  int dimension;
  size_t points;
  uint64_t fnv1a;  // of the doubles' bits, taken as 64-bit words
};

// Figures of cloud(kind, dimension, 1000) in bench/make_clouds.py.
TEST(CloudsTest, EqualToTheReferenceScript) {
  constexpr Expected kExpected[] = {
      {"uniform", 2, 1000, 0x11c8db5949bf2a10},  {"uniform", 3, 1000, 0xb4e6fe41592c2e54},
      {"inner", 2, 1000, 0xe2b94b8f4d26de92},    {"inner", 3, 1000, 0xfb534e7727fe0873},
      {"sphere", 2, 1000, 0x90a1536c8209dab5},   {"sphere", 3, 1000, 0x0dfaa587ad2c2b05},
      {"clusters", 2, 1000, 0xd65f49f069b8e4c6}, {"clusters", 3, 1000, 0x6ca994e2bef052b1},
      {"skew", 2, 1000, 0xd11bcba3fcbaedb2},     {"skew", 3, 1000, 0xce2d057d1cae12c0},
      {"moment", 2, 1000, 0xf0754200d9a6b52e},   {"moment", 3, 1000, 0x3c1940fc46314cb1},
      {"grid", 2, 1024, 0x0dc81cf8df2ec325},     {"grid", 3, 1000, 0x85ef54a5da464b85},
      {"lines", 2, 1000, 0x588404bb80d4190d},    {"lines", 3, 1000, 0xff7b45118b0efbff},
      {"annuli", 2, 1000, 0x254e6bf3a31e83fd},   {"annuli", 3, 1000, 0x487d0b73cca04620},
  };
  for (const Expected& expected : kExpected) {
    const std::vector<double> cloud = MakeCloud(expected.kind, expected.dimension, 1000);
    EXPECT_EQ(cloud.size(), expected.points * static_cast<size_t>(expected.dimension));
    uint64_t hash = 0xcbf29ce484222325;
    for (const double x : cloud) {
      hash = (hash ^ std::bit_cast<uint64_t>(x)) * 0x100000001b3;
    }
    EXPECT_EQ(hash, expected.fnv1a) << expected.kind << "-" << expected.dimension;
  }
}

TEST(CloudsTest, DegenerateCloudsLieInTheUnitBox) {
  for (const std::string_view kind : kDegenerateKinds) {
    for (const int dimension : {2, 3, 4, 5, 6}) {
      const std::vector<double> cloud = MakeCloud(kind, dimension, 200);
      EXPECT_TRUE(std::all_of(cloud.begin(), cloud.end(), [](double x) { return 0 <= x && x <= 1; })) << kind;
      if (kind != "none" && kind != "one" && kind != "slanted") {
        EXPECT_EQ(cloud.size(), 200u * static_cast<size_t>(dimension)) << kind;
      }
    }
  }
}

TEST(CloudsTest, CosphericalPointsAreExactlySo) {
  for (const int dimension : {2, 3, 4, 5, 6}) {
    const std::vector<double> cloud = MakeCloud("cospherical", dimension, 300);
    const size_t d = static_cast<size_t>(dimension);
    ASSERT_EQ(cloud.size(), 300 * d);
    std::set<double> squares;  // every term is an integer multiple of 2^-34 or more: no rounding
    for (size_t i = 0; i < 300; ++i) {
      double sum = 0;
      for (size_t k = 0; k < d; ++k) {
        sum += (cloud[i * d + k] - 0.5) * (cloud[i * d + k] - 0.5);
      }
      squares.insert(sum);
    }
    EXPECT_EQ(squares.size(), 1u);
  }
}

TEST(CloudsTest, ShuffledKeepsThePoints) {
  const std::vector<double> cloud = MakeCloud("uniform", 3, 100);
  const std::vector<double> shuffled = Shuffled(cloud, 3, 7);
  EXPECT_NE(cloud, shuffled);
  std::multiset<std::array<double, 3>> before;
  std::multiset<std::array<double, 3>> after;
  for (size_t i = 0; i < cloud.size(); i += 3) {
    before.insert({cloud[i], cloud[i + 1], cloud[i + 2]});
    after.insert({shuffled[i], shuffled[i + 1], shuffled[i + 2]});
  }
  EXPECT_EQ(before, after);
}

}  // namespace
}  // namespace wellspace::test
