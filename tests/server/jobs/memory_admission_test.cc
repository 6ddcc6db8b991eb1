// Which jobs may have memory, on random states against the definition of a safe one.
#include "server/jobs/memory_admission.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "gtest/gtest.h"
#include "tests/support/seeded_test.h"

namespace wellspace::server {
namespace {

JobMemory Waiting(uint64_t sequence, uint64_t run, uint64_t wanted) {
  return {.sequence = sequence, .is_waiting = true, .wanted = wanted, .run = run, .freed = run};
}

JobMemory Running(uint64_t run, bool has_all = false) { return {.has_all = has_all, .run = run, .freed = run}; }

TEST(FitsBesideSessions, CountsWhatSessionsKeepButNotWhatTheRunHasOfThem) {
  EXPECT_TRUE(FitsBesideSessions(100, 0, 0, 100));
  EXPECT_FALSE(FitsBesideSessions(101, 0, 0, 100));
  EXPECT_TRUE(FitsBesideSessions(70, 0, 30, 100));
  EXPECT_FALSE(FitsBesideSessions(71, 0, 30, 100));
  EXPECT_TRUE(FitsBesideSessions(90, 20, 30, 100));
  EXPECT_FALSE(FitsBesideSessions(91, 20, 30, 100));
  EXPECT_TRUE(FitsBesideSessions(100, 50, 30, 100)) << "what sessions keep was read before the run had it";
}

TEST(RoomForTree, IsUnboundedUnlessAJobWaitsWithItsTree) {
  EXPECT_EQ(RoomForTree(10, {}), kNoBound);
  const std::vector<JobMemory> begun = {Running(30), Running(20, true), Waiting(1, 0, 500)};
  EXPECT_EQ(RoomForTree(10, begun), kNoBound) << "the job that waits has no tree yet";
}

TEST(RoomForTree, LeavesWhatOneThatWaitsNeeds) {
  EXPECT_EQ(RoomForTree(100, std::vector{Waiting(1, 20, 90)}), 30u);
  EXPECT_EQ(RoomForTree(70, std::vector{Waiting(1, 20, 90)}), 0u);
}

TEST(RoomForTree, CountsWhatEndsAndNotTheTreesOfOthers) {
  EXPECT_EQ(RoomForTree(40, std::vector{Waiting(1, 20, 90), Running(50, true)}), 20u);
  EXPECT_EQ(RoomForTree(40, std::vector{Waiting(1, 20, 90), Running(50)}), 0u) << "a tree may want more before it ends";
}

TEST(RoomForTree, IsUnboundedWhereABoundHelpsNoMore) {
  EXPECT_EQ(RoomForTree(40, std::vector{Waiting(1, 20, 90)}), kNoBound);
  EXPECT_EQ(RoomForTree(40, std::vector{Waiting(1, 20, 90), Running(29)}), kNoBound);
}

TEST(RoomForTree, HasThoseThatWaitGoOnOneAfterTheOther) {
  // The second needs 60: 30, and 40 that the first will have freed.
  const std::vector<JobMemory> begun = {Waiting(1, 10, 70), Waiting(2, 40, 60)};
  EXPECT_EQ(RoomForTree(30, begun), 10u);
}

// Whether the jobs that wait with trees can go on one after the other, in some order, with `room`.
bool IsSafe(uint64_t room, std::vector<JobMemory> waiting) {
  while (!waiting.empty()) {
    const auto next =
        std::ranges::find_if(waiting, [room](const JobMemory& job) { return job.wanted - job.run <= room; });
    if (next == waiting.end()) {
      return false;
    }
    room += next->freed;
    waiting.erase(next);
  }
  return true;
}

class RoomForTreePropertyTest : public test::SeededTest {
 protected:
  RoomForTreePropertyTest() : SeededTest(623) {}
};

// The banker's algorithm: by the definition of a safe state, tried for every size of a tree.
TEST_F(RoomForTreePropertyTest, IsTheLargestTreeAfterWhichTheStateIsSafe) {
  int bounded = 0;
  for (int i = 0; i < 2'000; ++i) {
    std::vector<JobMemory> begun;
    for (uint64_t k = random_.Below(5); k > 0; --k) {
      const uint64_t run = 1 + random_.Below(10);
      begun.push_back(Waiting(k, run, run + random_.Below(20)));
    }
    const std::vector<JobMemory> waiting = begun;
    const uint64_t ending = random_.Below(10);
    begun.push_back(Running(ending, true));
    const uint64_t unreserved = random_.Below(20);
    const uint64_t most = RoomForTree(unreserved, begun);
    uint64_t room = unreserved + ending;
    if (!IsSafe(room, waiting)) {
      EXPECT_EQ(most, kNoBound);
      continue;
    }
    for (uint64_t tree = 0; tree <= room; ++tree) {
      EXPECT_EQ(tree <= most, IsSafe(room - tree, waiting)) << tree << " of " << room;
    }
    bounded += most < room ? 1 : 0;
  }
  EXPECT_GT(bounded, 100) << "else the test shows nothing";
}

TEST(VictimOfDeadlock, IsNoneWhileOtherWorkCanFreeMemory) {
  const std::vector<JobMemory> queued = {Waiting(1, 30, 80), Waiting(2, 30, 80)};
  EXPECT_EQ(VictimOfDeadlock(61, queued), std::nullopt) << "a call, say, has 1";
  EXPECT_EQ(VictimOfDeadlock(60, queued), 2u);
  EXPECT_EQ(VictimOfDeadlock(0, {}), std::nullopt);
}

TEST(VictimOfDeadlock, CountsWhatCallsHaveThatWaitForTheirJobs) {
  std::vector<JobMemory> queued = {Waiting(1, 40, 90)};
  EXPECT_FALSE(VictimOfDeadlock(45, queued).has_value()) << "5 may be freed";
  queued[0].of_call = 5;
  EXPECT_EQ(VictimOfDeadlock(45, queued), 1u) << "but not by the call that waits for the job";
}

TEST(VictimOfDeadlock, IsTheYoungestThatWaitsWithMemory) {
  const JobMemory with_points{.sequence = 9, .freed = 10};  // waits for a worker
  EXPECT_EQ(VictimOfDeadlock(70, std::vector{Waiting(2, 30, 80), Waiting(1, 30, 80), with_points}), 2u);
  EXPECT_EQ(VictimOfDeadlock(10, std::vector{Waiting(2, 0, 80), Waiting(1, 0, 80), with_points}), 9u)
      << "none waits with memory";
}

}  // namespace
}  // namespace wellspace::server
