// Turns of tenants and of their jobs, on queues drawn at random against a bound on the wait.
#include "server/jobs/fair_queue.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "tests/support/seeded_test.h"

namespace wellspace::server {
namespace {

bool Always(const QueuedJob& /*job*/) { return true; }
bool NeedsNoMemory(const QueuedJob& job) { return !job.waits_for_memory; }

// Starts jobs until none is found; returns them in this order.
std::vector<uint64_t> StartAll(FairQueue& queue, const std::vector<std::string>& tenant_of) {
  std::vector<uint64_t> order;
  while (const std::optional<uint64_t> next = queue.FindFirst(Always)) {
    queue.Start(tenant_of.at(*next), *next);
    order.push_back(*next);
  }
  return order;
}

TEST(FairQueue, TenantsTakeTurns) {
  const std::vector<std::string> tenant_of = {"a", "a", "a", "a", "b", "b", "c"};
  FairQueue queue;
  for (uint64_t i = 0; i < tenant_of.size(); ++i) {
    queue.Add({.sequence = i, .tenant = tenant_of[i]});
  }
  EXPECT_EQ(queue.size(), 7u);
  EXPECT_EQ(StartAll(queue, tenant_of), std::vector<uint64_t>({0, 4, 6, 1, 5, 2, 3}));
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.FindFirst(Always), std::nullopt);
}

TEST(FairQueue, AJobThatComesBackTakesItsPlaceAmongThoseOfItsTenant) {
  const std::vector<std::string> tenant_of = {"a", "a", "a"};
  FairQueue queue;
  queue.Add({.sequence = 2, .tenant = "a"});
  queue.Add({.sequence = 0, .tenant = "a", .waits_for_memory = true});
  queue.Add({.sequence = 1, .tenant = "a"});
  EXPECT_EQ(StartAll(queue, tenant_of), std::vector<uint64_t>({0, 1, 2}));
}

TEST(FairQueue, AJobThatLeavesTakesNoTurn) {
  const std::vector<std::string> tenant_of = {"a", "a", "b"};
  FairQueue queue;
  for (uint64_t i = 0; i < tenant_of.size(); ++i) {
    queue.Add({.sequence = i, .tenant = tenant_of[i]});
  }
  queue.Remove("a", 0);
  EXPECT_EQ(queue.size(), 2u);
  EXPECT_EQ(StartAll(queue, tenant_of), std::vector<uint64_t>({1, 2}));
}

TEST(FairQueue, JobsStayBehindTheFirstOfTheirTenantAndThoseOfOthersDoNot) {
  FairQueue queue;
  queue.Add({.sequence = 0, .tenant = "a", .waits_for_memory = true});
  queue.Add({.sequence = 1, .tenant = "a"});
  EXPECT_EQ(queue.FindFirst(NeedsNoMemory), std::nullopt);
  queue.Add({.sequence = 2, .tenant = "b"});
  EXPECT_EQ(queue.FindFirst(NeedsNoMemory), 2u);
}

TEST(FairQueue, AsksInTheOrderOfTurnsAndNoMoreThanItNeeds) {
  FairQueue queue;
  queue.Add({.sequence = 0, .tenant = "b"});
  queue.Add({.sequence = 1, .tenant = "a"});
  queue.Add({.sequence = 2, .tenant = "c"});
  std::vector<uint64_t> asked;
  EXPECT_EQ(queue.FindFirst([&asked](const QueuedJob& job) {
    asked.push_back(job.sequence);
    return job.tenant == "a";
  }),
            1u);
  EXPECT_EQ(asked, std::vector<uint64_t>({0, 1}));
}

TEST(FairQueue, SmallJobsAreHeldUpByNoOthers) {
  FairQueue queue;
  queue.Add({.sequence = 0, .tenant = "a"});
  queue.Add({.sequence = 1, .tenant = "a", .is_small = true});
  queue.Add({.sequence = 2, .tenant = "b", .is_small = true, .waits_for_memory = true});
  queue.Add({.sequence = 3, .tenant = "a", .is_small = true});
  EXPECT_EQ(queue.FindSmall(Always), 1u);
  queue.Start("a", 1);
  EXPECT_EQ(queue.FindSmall(Always), 2u) << "the turn is that of b";
  EXPECT_EQ(queue.FindSmall(NeedsNoMemory), 3u);
  queue.Start("b", 2);
  queue.Start("a", 3);
  EXPECT_EQ(queue.FindSmall(Always), std::nullopt);
}

TEST(FairQueue, AJobIsStarvedOnceItWasSkippedOften) {
  FairQueue queue;
  queue.Add({.sequence = 0, .tenant = "a"});
  queue.Add({.sequence = 1, .tenant = "b", .waits_for_memory = true});
  queue.Add({.sequence = 2, .tenant = "b", .waits_for_memory = true});
  for (int i = 0; i < FairQueue::kMaxSkips; ++i) {
    EXPECT_EQ(queue.FindStarved(), nullptr) << i;
    queue.CountSkips();
  }
  ASSERT_NE(queue.FindStarved(), nullptr);
  EXPECT_EQ(queue.FindStarved()->sequence, 1u) << "job 0 waits for a worker, and job 2 is behind it";
  queue.Remove("b", 1);
  EXPECT_EQ(queue.FindStarved(), nullptr) << "job 2 was never skipped";
}

TEST(FairQueue, OfTwoStarvedJobsTheOldestIsFound) {
  FairQueue queue;
  queue.Add({.sequence = 5, .tenant = "a", .waits_for_memory = true});
  queue.Add({.sequence = 3, .tenant = "b", .waits_for_memory = true});
  for (int i = 0; i < FairQueue::kMaxSkips; ++i) {
    queue.CountSkips();
  }
  EXPECT_EQ(queue.FindStarved()->sequence, 3u);
  queue.ForgetSkips("b", 3);
  EXPECT_EQ(queue.FindStarved()->sequence, 5u);
  queue.Start("a", 5);
  queue.Add({.sequence = 5, .tenant = "a", .waits_for_memory = true});
  EXPECT_EQ(queue.FindStarved(), nullptr) << "a job that waits anew was not skipped yet";
}

class FairQueuePropertyTest : public test::SeededTest {
 protected:
  FairQueuePropertyTest() : SeededTest(42) {}
};

TEST_F(FairQueuePropertyTest, ATenantWithJobsHasItsTurnAfterAtMostOneOfEachOther) {
  FairQueue queue;
  std::vector<std::string> tenant_of;
  std::map<std::string, int> waiting;          // jobs, by tenant
  std::map<std::string, int> turns_of_others;  // since a tenant's last turn, or since it has had jobs
  for (int i = 0; i < 20'000; ++i) {
    if (random_.Below(2) == 0) {
      const std::string tenant(1, static_cast<char>('a' + random_.Below(6)));
      queue.Add({.sequence = tenant_of.size(), .tenant = tenant});
      tenant_of.push_back(tenant);
      if (waiting[tenant]++ == 0) {
        turns_of_others[tenant] = 0;
      }
    } else if (const std::optional<uint64_t> next = queue.FindFirst(Always)) {
      const std::string tenant = tenant_of[*next];
      queue.Start(tenant, *next);
      for (auto& [other, turns] : turns_of_others) {
        turns += other == tenant || waiting[other] == 0 ? 0 : 1;
        ASSERT_LE(turns, 5) << other;
      }
      turns_of_others[tenant] = 0;
      --waiting[tenant];
    }
  }
}

}  // namespace
}  // namespace wellspace::server
