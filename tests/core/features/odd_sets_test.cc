// Sets of numbers that are joined.
#include "core/features/odd_sets.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

class OddSetsTest : public test::SeededTest {
 protected:
  OddSetsTest() : SeededTest(0x0dd5) {}
};

TEST_F(OddSetsTest, ASetHasWhatIsInAnOddNumberOfItsParts) {
  constexpr uint32_t kBound = 20;
  OddSets sets(kBound);
  std::vector<std::pair<uint32_t, std::set<uint32_t>>> known = {{OddSets::kEmpty, {}}};
  for (uint32_t i = 0; i < kBound; ++i) {
    known.push_back({i, {i}});
  }
  for (int step = 0; step < 200; ++step) {
    const auto& [one, members] = known[random_.Below(known.size())];
    const auto& [other, more] = known[random_.Below(known.size())];
    std::set<uint32_t> expected = members;
    for (const uint32_t i : more) {
      if (expected.erase(i) == 0) {
        expected.insert(i);
      }
    }
    const uint32_t joined = sets.Join(one, other);
    EXPECT_EQ(sets.MembersOf(joined), std::vector<uint32_t>(expected.begin(), expected.end()));
    known.push_back({joined, std::move(expected)});
  }
}

}  // namespace
}  // namespace wellspace::core
