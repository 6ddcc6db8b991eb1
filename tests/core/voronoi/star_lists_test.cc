// Lists of simplices, and which vertices spoil them, against a model.
#include "core/voronoi/star_lists.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::IsEmpty;
using ::testing::Le;
using ::testing::Pair;
using ::testing::SizeIs;

using Edge = std::array<uint32_t, 2>;

Star<2> StarOf(const std::vector<Edge>& edges) {
  Star<2> star;
  for (const Edge& edge : edges) {
    star.push_back({VertexId{edge[0]}, VertexId{edge[1]}});
  }
  return star;
}

std::vector<Edge> EdgesAt(const StarLists<2>& lists, uint32_t v) {
  std::vector<Edge> edges;
  for (const auto& simplex : lists.Of(VertexId{v})) {
    edges.push_back({Index(simplex[0]), Index(simplex[1])});
  }
  return edges;
}

TEST(StarListsTest, ListOnlyWhatHasBeenLookedAt) {
  StarLists<2> lists;
  EXPECT_THAT(EdgesAt(lists, 3), IsEmpty());
  lists.Set(VertexId{3}, StarOf({{0, 1}, {1, 2}}), 10);
  EXPECT_THAT(EdgesAt(lists, 3), IsEmpty());
  lists.Set(VertexId{1}, StarOf({{2, 3}, {3, 0}}), 10);
  EXPECT_THAT(EdgesAt(lists, 1), IsEmpty());
  lists.Set(VertexId{0}, StarOf({{3, 1}, {1, 9}, {3, 2}}), 10);
  EXPECT_THAT(EdgesAt(lists, 0), ElementsAre(Edge{3, 1}));
  EXPECT_THAT(EdgesAt(lists, 3), IsEmpty());
  EXPECT_THAT(EdgesAt(lists, 2), IsEmpty());
  EXPECT_THAT(EdgesAt(lists, 4'000'000'000), IsEmpty());
}

TEST(StarListsTest, AreReplacedByFewerAndByMore) {
  StarLists<2> lists;
  for (const uint32_t v : {0, 1, 2, 3}) {
    lists.Set(VertexId{v}, {}, 6);
  }
  lists.Set(VertexId{4}, StarOf({{0, 1}, {1, 2}}), 6);
  lists.Set(VertexId{5}, StarOf({{4, 3}}), 6);
  lists.Set(VertexId{4}, StarOf({{5, 0}}), 6);
  EXPECT_THAT(EdgesAt(lists, 4), ElementsAre(Edge{5, 0}));
  EXPECT_THAT(EdgesAt(lists, 5), ElementsAre(Edge{4, 3}));
  lists.Set(VertexId{4}, StarOf({{0, 1}, {2, 3}, {5, 0}}), 6);
  EXPECT_THAT(EdgesAt(lists, 4), ElementsAre(Edge{0, 1}, Edge{2, 3}, Edge{5, 0}));
  EXPECT_THAT(EdgesAt(lists, 5), ElementsAre(Edge{4, 3}));
  lists.Set(VertexId{4}, {}, 6);
  EXPECT_THAT(EdgesAt(lists, 4), IsEmpty());
}

// Four vertices, then a fifth that comes after 1 has been looked at, and before 2.
TEST(StarListsTest, KnowWhoWasLookedAtAndWhoCameAfter) {
  StarLists<2> lists;
  lists.Set(VertexId{0}, {}, 4);
  lists.Set(VertexId{3}, {}, 4);
  lists.Set(VertexId{1}, StarOf({{0, 3}}), 4);
  lists.Set(VertexId{2}, StarOf({{0, 1}}), 5);
  lists.Set(VertexId{4}, StarOf({{1, 2}, {2, 3}}), 5);
  EXPECT_TRUE(lists.WasLookedAtBefore(VertexId{0}, VertexId{1}));
  EXPECT_TRUE(lists.WasLookedAtBefore(VertexId{3}, VertexId{1}));
  EXPECT_TRUE(lists.WasLookedAtBefore(VertexId{1}, VertexId{2}));
  EXPECT_FALSE(lists.WasLookedAtBefore(VertexId{2}, VertexId{1}));
  EXPECT_FALSE(lists.WasLookedAtBefore(VertexId{4}, VertexId{2}));
  EXPECT_TRUE(lists.CameAfter(VertexId{4}, VertexId{1}));
  EXPECT_FALSE(lists.CameAfter(VertexId{4}, VertexId{2}));
  EXPECT_FALSE(lists.CameAfter(VertexId{2}, VertexId{1}));

  const RunContext context;
  const absl::StatusOr<StaleStars> stale = StaleStars::Of(lists, 5, context);
  ASSERT_TRUE(stale.ok()) << stale.status();
  EXPECT_THAT(stale->At(VertexId{1}), ElementsAre(Pair(VertexId{1}, VertexId{4})));
  EXPECT_THAT(stale->At(VertexId{2}), IsEmpty());
  EXPECT_THAT(stale->At(VertexId{4}), IsEmpty());

  lists.Set(VertexId{1}, StarOf({{0, 3}, {4, 2}}), 5);
  EXPECT_TRUE(lists.WasLookedAtBefore(VertexId{4}, VertexId{1}));
  EXPECT_FALSE(lists.CameAfter(VertexId{4}, VertexId{1}));
  const absl::StatusOr<StaleStars> none = StaleStars::Of(lists, 5, context);
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_THAT(none->At(VertexId{1}), IsEmpty()) << "it has been looked at since";
}

// Lists that are replaced leave their places behind; these come back.
TEST(StarListsTest, PlacesThatAreNotUsedAreDropped) {
  constexpr uint32_t kCount = 16;
  std::vector<Edge> all;
  StarLists<2> lists;
  for (uint32_t v = 0; v < kCount; ++v) {
    lists.Set(VertexId{v}, {}, kCount);
    all.push_back({v, (v + 1) % kCount});
  }
  const uint64_t empty_bytes = lists.MemoryBytes();
  const std::vector<Edge> few = {{1, 2}};
  for (int round = 0; round < 100; ++round) {
    for (uint32_t v = 3; v < kCount; ++v) {
      for (const std::vector<Edge>& edges : {few, all}) {
        lists.Set(VertexId{v}, StarOf(edges), kCount);
        ASSERT_EQ(EdgesAt(lists, v), edges);
        ASSERT_LE(lists.MemoryBytes(), empty_bytes + (2 * kCount + 1) * kCount * sizeof(Edge) + kCount);
      }
    }
  }
  EXPECT_TRUE(lists.IsComplete());
}

// A vertex that is looked at again and again makes the lists of its neighbours stale each time.
TEST(StarListsTest, PairsThatAreLateTwiceAreDropped) {
  StarLists<2> lists;
  for (uint32_t v = 0; v < 3; ++v) {
    lists.Set(VertexId{v}, StarOf({{(v + 1) % 3, (v + 2) % 3}}), 3);
  }
  for (int round = 0; round < 100; ++round) {
    lists.Set(VertexId{3}, StarOf({{0, 1}, {1, 2}, {2, 0}}), 4);
    ASSERT_THAT(lists.stale(), SizeIs(AllOf(Ge(3u), Le(12u))));
  }
  const absl::StatusOr<StaleStars> stale = StaleStars::Of(lists, 4, RunContext());
  ASSERT_TRUE(stale.ok()) << stale.status();
  EXPECT_THAT(stale->At(VertexId{2}), ElementsAre(Pair(VertexId{2}, VertexId{3})));
}

TEST(StarListsTest, ListNothingOnceTheyHaveGivenUp) {
  StarLists<2> lists;
  lists.Set(VertexId{0}, {}, 3);
  lists.Set(VertexId{1}, {}, 3);
  lists.GiveUp();
  EXPECT_FALSE(lists.IsComplete());
  lists.Set(VertexId{2}, StarOf({{0, 1}}), 3);
  EXPECT_THAT(EdgesAt(lists, 2), IsEmpty());
  EXPECT_EQ(lists.MemoryBytes(), 0);
  lists.Clear();
  EXPECT_TRUE(lists.IsComplete());
}

TEST(StarListsTest, ForgetEverything) {
  StarLists<2> lists;
  lists.Set(VertexId{0}, {}, 3);
  lists.Set(VertexId{1}, {}, 3);
  lists.Set(VertexId{2}, StarOf({{0, 1}}), 3);
  lists.Clear();
  EXPECT_EQ(lists.MemoryBytes(), 0);
  EXPECT_THAT(EdgesAt(lists, 2), IsEmpty());
  lists.Set(VertexId{2}, StarOf({{0, 1}}), 3);
  EXPECT_THAT(EdgesAt(lists, 2), IsEmpty()) << "0 and 1 have not been looked at since";
}

TEST(LateNeighboursTest, AreCancelled) {
  StarLists<2> lists;
  lists.Set(VertexId{0}, {}, 1);
  for (const bool deadline : {false, true}) {
    RunContext context;
    deadline ? context.ExceedDeadline() : context.Cancel();
    EXPECT_EQ(StaleStars::Of(lists, 1, context).status().code(),
              deadline ? absl::StatusCode::kDeadlineExceeded : absl::StatusCode::kCancelled);
  }
}

// The list of a vertex, and the time of the look that made it; the time when the vertex was added.
struct ModelEntry {
  std::vector<std::array<VertexId, 3>> listed;
  int look = -1;
  int added = -1;
  // Those that came after that look, and had the vertex in their star when they were looked at.
  std::set<VertexId> stale;
};

class StarListsPropertyTest : public test::SeededTest {
 protected:
  StarListsPropertyTest() : SeededTest(1934) {}

  VertexId Draw(size_t count) { return VertexId{static_cast<uint32_t>(random_.Below(count))}; }
};

TEST_F(StarListsPropertyTest, HoldWhatAModelHolds) {
  constexpr size_t kMostVertices = 60;
  const RunContext context;
  StarLists<3> lists;
  std::vector<ModelEntry> model(10);
  size_t stale_count = 0;
  for (int step = 0; step < 6'000; ++step) {
    if (random_.Below(2000) == 0) {
      lists.Clear();
      model.assign(10, {});
    }
    if (model.size() < kMostVertices && random_.Below(8) == 0) {
      model.emplace_back().added = step;
    }
    const VertexId v = Draw(model.size());
    Star<3> star(random_.Below(20));
    std::vector<std::array<VertexId, 3>> listed;
    for (auto& simplex : star) {
      for (VertexId& u : simplex) {
        do {
          u = Draw(model.size());
        } while (u == v);
      }
      if (std::all_of(simplex.begin(), simplex.end(), [&](VertexId u) { return model[Index(u)].look >= 0; })) {
        listed.push_back(simplex);
      }
    }
    lists.Set(v, star, static_cast<uint32_t>(model.size()));
    for (const auto& simplex : star) {
      for (const VertexId u : simplex) {
        if (model[Index(u)].look >= 0 && model[Index(v)].added > model[Index(u)].look) {
          model[Index(u)].stale.insert(v);
        }
      }
    }
    model[Index(v)].listed = listed;
    model[Index(v)].look = step;
    model[Index(v)].stale.clear();

    size_t simplices = 0;
    size_t stale_now = 0;
    for (uint32_t u = 0; u < model.size(); ++u) {
      stale_now += model[u].stale.size();
      const auto actual = lists.Of(VertexId{u});
      ASSERT_EQ(Star<3>(actual.begin(), actual.end()), model[u].listed) << "of " << u << " after step " << step;
      simplices += actual.size();
    }
    const size_t most_listed = 2 * simplices + 1 + model.size() / 8;
    ASSERT_LE(lists.MemoryBytes() - lists.stale().size_bytes(), 12 * model.size() + 12 * most_listed);
    ASSERT_LE(lists.stale().size(), stale_now + 3 * most_listed);
    if (step % 20 != 0) {
      continue;
    }
    for (uint32_t i = 0; i < model.size(); ++i) {
      for (uint32_t k = 0; k < model.size(); ++k) {
        if (i != k && model[i].look >= 0 && model[k].look >= 0 && !model[i].listed.empty()) {
          ASSERT_EQ(lists.WasLookedAtBefore(VertexId{k}, VertexId{i}), model[k].look < model[i].look);
          ASSERT_EQ(lists.CameAfter(VertexId{k}, VertexId{i}), model[k].added > model[i].look);
        }
      }
    }
    const absl::StatusOr<StaleStars> stale = StaleStars::Of(lists, static_cast<uint32_t>(model.size()), context);
    ASSERT_TRUE(stale.ok()) << stale.status();
    for (uint32_t u = 0; u < model.size(); ++u) {
      if (model[u].listed.empty()) {
        continue;  // nothing to be spoiled
      }
      stale_count += model[u].stale.size();
      std::vector<StalePair> expected;
      for (const VertexId x : model[u].stale) {
        expected.emplace_back(VertexId{u}, x);
      }
      const auto actual = stale->At(VertexId{u});
      ASSERT_EQ(std::vector<StalePair>(actual.begin(), actual.end()), expected) << "at " << u << " after step " << step;
    }
  }
  EXPECT_GT(stale_count, 100u);
}

}  // namespace
}  // namespace wellspace::core
