// Lists of neighbours against sets, and the table of both sides.
#include "core/voronoi/neighbour_lists.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

using Model = std::map<VertexId, std::set<VertexId>>;

std::vector<VertexId> Ids(const std::vector<uint32_t>& numbers) {
  std::vector<VertexId> ids;
  for (const uint32_t number : numbers) {
    ids.push_back(VertexId{number});
  }
  return ids;
}

std::vector<uint32_t> NumbersOf(const NeighbourLists& lists, uint32_t v) {
  std::vector<uint32_t> numbers;
  for (const VertexId u : lists.Of(VertexId{v})) {
    numbers.push_back(Index(u));
  }
  return numbers;
}

std::vector<VertexId> AllAt(const NeighbourTable& table, VertexId v) {
  std::vector<VertexId> all;
  table.ForEachAt(v, [&](VertexId u) { all.push_back(u); });
  return all;
}

// What a vertex and a list of `count` neighbours take.
constexpr uint64_t BytesFor(uint64_t count) { return sizeof(uint32_t) * (1 + 1 + count); }

TEST(NeighbourListsTest, ListOnlyWhatHasBeenLookedAt) {
  NeighbourLists lists;
  EXPECT_THAT(NumbersOf(lists, 3), IsEmpty());
  lists.Set(VertexId{3}, Ids({0, 1, 2}));
  EXPECT_THAT(NumbersOf(lists, 3), IsEmpty());
  lists.Set(VertexId{1}, Ids({2, 3, 0, 9}));
  EXPECT_THAT(NumbersOf(lists, 1), ElementsAre(3));
  lists.Set(VertexId{0}, Ids({1, 2, 3}));
  EXPECT_THAT(NumbersOf(lists, 0), ElementsAre(1, 3));
  EXPECT_THAT(NumbersOf(lists, 3), IsEmpty());
  EXPECT_THAT(NumbersOf(lists, 2), IsEmpty());
  EXPECT_THAT(NumbersOf(lists, 4'000'000'000), IsEmpty());
}

TEST(NeighbourListsTest, AreReplacedByFewerAndByMore) {
  NeighbourLists lists;
  for (const uint32_t v : {0, 1, 2, 3}) {
    lists.Set(VertexId{v}, {});
  }
  lists.Set(VertexId{4}, Ids({0, 1, 2}));
  lists.Set(VertexId{5}, Ids({4, 3}));
  lists.Set(VertexId{4}, Ids({5}));
  EXPECT_THAT(NumbersOf(lists, 4), ElementsAre(5));
  EXPECT_THAT(NumbersOf(lists, 5), ElementsAre(4, 3));
  lists.Set(VertexId{4}, Ids({0, 1, 2, 3, 5}));
  EXPECT_THAT(NumbersOf(lists, 4), ElementsAre(0, 1, 2, 3, 5));
  EXPECT_THAT(NumbersOf(lists, 5), ElementsAre(4, 3));
  lists.Set(VertexId{4}, {});
  EXPECT_THAT(NumbersOf(lists, 4), IsEmpty());
  lists.Set(VertexId{0}, Ids({4}));
  EXPECT_THAT(NumbersOf(lists, 0), ElementsAre(4));
}

TEST(NeighbourListsTest, TakeHighNumbersInAnyOrder) {
  constexpr uint32_t kHigh = 1'000'000;
  NeighbourLists lists;
  lists.Set(VertexId{kHigh}, {});
  lists.Set(VertexId{17}, Ids({kHigh, kHigh - 1}));
  lists.Set(VertexId{kHigh - 1}, Ids({17, kHigh, kHigh + 1}));
  lists.Set(VertexId{kHigh + 1}, Ids({kHigh - 1, 0}));
  EXPECT_THAT(NumbersOf(lists, kHigh), IsEmpty());
  EXPECT_THAT(NumbersOf(lists, 17), ElementsAre(kHigh));
  EXPECT_THAT(NumbersOf(lists, kHigh - 1), ElementsAre(17, kHigh));
  EXPECT_THAT(NumbersOf(lists, kHigh + 1), ElementsAre(kHigh - 1));
  EXPECT_THAT(NumbersOf(lists, 0), IsEmpty());
}

// Lists that grow leave their places behind; these come back.
TEST(NeighbourListsTest, PlacesThatAreNotUsedAreDropped) {
  constexpr uint32_t kCount = 16;
  std::vector<uint32_t> all;
  NeighbourLists lists;
  for (uint32_t v = 0; v < kCount; ++v) {
    lists.Set(VertexId{v}, {});
    all.push_back(v);
  }
  const std::vector<uint32_t> few = {1, 2};
  for (int round = 0; round < 100; ++round) {
    for (uint32_t v = 3; v < kCount; ++v) {
      for (const std::vector<uint32_t>& numbers : {few, all}) {
        lists.Set(VertexId{v}, Ids(numbers));
        ASSERT_EQ(NumbersOf(lists, v), numbers);
        ASSERT_LE(lists.MemoryBytes(), 2 * kCount * BytesFor(kCount));
      }
    }
  }
  EXPECT_FALSE(lists.IsFull());
}

TEST(NeighbourListsTest, ForgetEverything) {
  NeighbourLists lists;
  lists.Set(VertexId{0}, {});
  lists.Set(VertexId{1}, Ids({0}));
  lists.Clear();
  EXPECT_EQ(lists.MemoryBytes(), 0);
  EXPECT_THAT(NumbersOf(lists, 1), IsEmpty());
  lists.Set(VertexId{1}, Ids({0}));
  EXPECT_THAT(NumbersOf(lists, 1), IsEmpty()) << "0 has not been looked at since";
}

TEST(NeighbourTableTest, HasBothSides) {
  NeighbourLists lists;
  lists.Set(VertexId{2}, Ids({0, 1}));
  lists.Set(VertexId{0}, Ids({2}));
  lists.Set(VertexId{1}, Ids({0, 2}));
  const RunContext context;
  const absl::StatusOr<NeighbourTable> table = NeighbourTable::Of(lists, 3, context);
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_THAT(AllAt(*table, VertexId{0}), UnorderedElementsAre(VertexId{1}, VertexId{2}));
  EXPECT_THAT(AllAt(*table, VertexId{1}), UnorderedElementsAre(VertexId{0}, VertexId{2}));
  EXPECT_THAT(AllAt(*table, VertexId{2}), UnorderedElementsAre(VertexId{0}, VertexId{1}));
  EXPECT_EQ(table->MemoryBytes(), lists.MemoryBytes() + (3 + 1 + 3) * sizeof(uint32_t));
}

TEST(NeighbourTableTest, IsCancelled) {
  NeighbourLists lists;
  lists.Set(VertexId{0}, {});
  for (const bool deadline : {false, true}) {
    RunContext context;
    deadline ? context.ExceedDeadline() : context.Cancel();
    EXPECT_EQ(NeighbourTable::Of(lists, 1, context).status().code(),
              deadline ? absl::StatusCode::kDeadlineExceeded : absl::StatusCode::kCancelled);
  }
}

class NeighbourListsPropertyTest : public test::SeededTest {
 protected:
  NeighbourListsPropertyTest() : SeededTest(1934) {}
};

TEST_F(NeighbourListsPropertyTest, HoldWhatAModelHolds) {
  constexpr uint32_t kCount = 60;
  const RunContext context;
  NeighbourLists lists;
  Model model;
  for (int step = 0; step < 4'000; ++step) {
    if (random_.Below(1500) == 0) {
      lists.Clear();
      model.clear();
    }
    const VertexId v{static_cast<uint32_t>(random_.Below(kCount))};
    const uint64_t share = 1 + random_.Below(20);
    std::vector<VertexId> neighbours;
    for (uint32_t u = kCount; u-- > 0;) {
      if (VertexId{u} != v && random_.Below(share) == 0) {
        neighbours.push_back(VertexId{u});
      }
    }
    lists.Set(v, neighbours);
    std::set<VertexId> listed;
    std::copy_if(neighbours.begin(), neighbours.end(), std::inserter(listed, listed.end()),
                 [&](VertexId u) { return model.count(u) > 0; });
    model[v] = listed;

    uint64_t bytes = kCount * sizeof(uint32_t);
    for (uint32_t u = 0; u < kCount; ++u) {
      const auto found = model.find(VertexId{u});
      const std::set<VertexId> expected = found == model.end() ? std::set<VertexId>() : found->second;
      const auto actual = lists.Of(VertexId{u});
      ASSERT_EQ(std::vector<VertexId>(actual.rbegin(), actual.rend()),
                std::vector<VertexId>(expected.begin(), expected.end()))
          << "of " << u << " after step " << step;
      bytes += 2 * BytesFor(expected.size());
    }
    ASSERT_LE(lists.MemoryBytes(), bytes);
    if (step % 50 != 0 || model.size() < kCount) {
      continue;
    }
    const absl::StatusOr<NeighbourTable> table = NeighbourTable::Of(lists, kCount, context);
    ASSERT_TRUE(table.ok()) << table.status();
    for (uint32_t u = 0; u < kCount; ++u) {
      std::multiset<VertexId> expected(model[VertexId{u}].begin(), model[VertexId{u}].end());
      for (const auto& [w, of_w] : model) {
        if (of_w.count(VertexId{u}) > 0) {
          expected.insert(w);
        }
      }
      const std::vector<VertexId> all = AllAt(*table, VertexId{u});
      ASSERT_EQ(std::multiset<VertexId>(all.begin(), all.end()), expected) << "at " << u << " after step " << step;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
