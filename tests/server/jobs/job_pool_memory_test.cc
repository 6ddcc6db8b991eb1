// Jobs that wait for memory.
#include <atomic>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include "server/jobs/job_pool.h"
#include "server/wire/errors.h"
#include "tests/server/jobs/test_jobs.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

TEST(JobPool, ALargeJobWaitsForMemoryWhileSmallOnesOfOthersFinish) {
  Needy holder(60 * kMegabyte);
  Needy large(80 * kMegabyte);
  Pool pool(2, 20, 20, kMaxMemory);
  ASSERT_NE(pool.Submit(holder.Work(), "a"), nullptr);
  ASSERT_TRUE(holder.reserved.Wait());
  ASSERT_NE(pool.Submit(large.Work(), "a"), nullptr);
  ASSERT_TRUE(large.began.Wait());
  WaitForQueued(pool, 1);
  EXPECT_EQ(pool.GetLoad().running, 1);  // it has given its worker away
  for (int i = 0; i < 5; ++i) {
    Needy small(kMegabyte);
    small.may_end.Set();
    ASSERT_NE(pool.Submit(small.Work(), "b"), nullptr);
    ASSERT_TRUE(small.ended.Wait());
    EXPECT_TRUE(small.status.ok()) << small.status;
  }
  EXPECT_EQ(pool.GetLoad().queued, 1);
  while (pool.GetLoad().running > 1) {  // the last small one has ended, but may still have its memory
    std::this_thread::yield();
  }
  holder.may_end.Set();
  ASSERT_TRUE(large.reserved.Wait());
  EXPECT_TRUE(large.status.ok()) << large.status;
  EXPECT_EQ(pool.memory.reserved(), large.bytes);
  large.may_end.Set();
  ASSERT_TRUE(large.ended.Wait());
}

TEST(JobPool, AJobThatWasSkippedOftenGoesFirst) {
  Needy holder(60 * kMegabyte);
  Needy large(80 * kMegabyte);
  Pool pool(2, 100, 100, kMaxMemory);
  pool.Submit(holder.Work(), "a");
  ASSERT_TRUE(holder.reserved.Wait());
  pool.Submit(large.Work(), "b");
  ASSERT_TRUE(large.began.Wait());
  WaitForQueued(pool, 1);
  int skips = 0;
  while (true) {
    Needy small(kMegabyte);
    small.may_end.Set();
    const std::shared_ptr<Job> job = pool.Submit(small.Work(), "c");
    while (!small.ended.IsSet() && pool.GetLoad().queued < 2) {
      std::this_thread::yield();
    }
    if (!small.ended.IsSet()) {  // none comes before it any more
      EXPECT_FALSE(large.reserved.IsSet());
      holder.may_end.Set();
      ASSERT_TRUE(large.reserved.Wait());
      EXPECT_TRUE(large.status.ok()) << large.status;
      large.may_end.Set();
      ASSERT_TRUE(small.ended.Wait());
      break;
    }
    ++skips;
    ASSERT_LE(skips, FairQueue::kMaxSkips);
    while (pool.GetLoad().running > 1) {
      std::this_thread::yield();
    }
  }
  EXPECT_GE(skips,
            FairQueue::kMaxSkips - 1);  // the last that comes before it may have to wait when it asks for its memory
}

TEST(JobPool, WhatNeverFitsIsRefusedAtOnceWithFiguresAndNoRetry) {
  Needy huge(101 * kMegabyte);
  Pool pool(1, 1, 1, kMaxMemory);
  pool.Submit(huge.Work());
  ASSERT_TRUE(huge.ended.Wait());
  const grpc::Status status = ToGrpcStatus(huge.status);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT");
  EXPECT_FALSE(DetailsOf(status).may_retry);
  EXPECT_EQ(status.error_message(),
            "the job needs 105.9 MB of memory; this server has 104.9 MB for all work: make it smaller");
}

TEST(JobPool, WhatSessionsLeaveNoRoomForIsRefusedAtOnceButMayBeRetried) {
  Needy large(80 * kMegabyte);
  Pool pool(1, 1, 1, kMaxMemory);
  absl::StatusOr<MemoryReservation> session = pool.memory.Reserve(30 * kMegabyte, "a session");
  ASSERT_TRUE(session.ok());
  session->MakeLasting();
  pool.Submit(large.Work());
  ASSERT_TRUE(large.ended.Wait());
  EXPECT_EQ(DetailsOf(large.status).reason, "MEMORY_LIMIT");
  EXPECT_TRUE(DetailsOf(large.status).may_retry);
}

TEST(JobPool, WhenAllWaitForOneAnotherTheYoungestTreeIsRefusedAndTheOldestGoesOn) {
  // Each wants more beside its tree than the others' trees leave; the last one not even has a tree when the others
  // wait.
  WithTree jobs[] = {{30 * kMegabyte, 70 * kMegabyte},
                     {30 * kMegabyte, 70 * kMegabyte},
                     {30 * kMegabyte, 70 * kMegabyte},
                     {30 * kMegabyte, 70 * kMegabyte}};
  Pool pool(3, 10, 10, kMaxMemory);
  for (WithTree& job : std::span(jobs).first(3)) {
    ASSERT_NE(pool.Submit(job.Work(), std::to_string(&job - jobs)), nullptr);
    ASSERT_TRUE(job.has_tree.Wait());
  }
  ASSERT_NE(pool.Submit(jobs[3].Work(), "3"), nullptr);
  for (WithTree& job : jobs) {
    job.may_go_on.Set();
  }
  for (WithTree& job : jobs) {
    ASSERT_TRUE(job.ended.Wait());
    EXPECT_TRUE(job.tree_status.ok()) << job.tree_status;
  }
  EXPECT_TRUE(jobs[0].mesh_status.ok()) << jobs[0].mesh_status;
  EXPECT_TRUE(jobs[1].mesh_status.ok()) << jobs[1].mesh_status;
  EXPECT_EQ(DetailsOf(jobs[2].mesh_status).reason, "MEMORY_LIMIT");
  EXPECT_TRUE(DetailsOf(jobs[2].mesh_status).may_retry);
  EXPECT_TRUE(jobs[3].mesh_status.ok()) << jobs[3].mesh_status;
}

TEST(JobPool, AJobThatWaitsForWhatItsOwnCallHoldsIsRefused) {
  Needy job(95 * kMegabyte);
  Pool pool(1, 1, 1, kMaxMemory);
  const absl::StatusOr<MemoryReservation> call = pool.memory.Reserve(10 * kMegabyte, "a call");
  ASSERT_TRUE(call.ok());
  ASSERT_TRUE(pool.pool.Submit({.of_call = call->bytes(), .work = job.Work()}).ok());
  ASSERT_TRUE(job.ended.Wait());
  EXPECT_EQ(DetailsOf(job.status).reason, "MEMORY_LIMIT");
  EXPECT_TRUE(DetailsOf(job.status).may_retry);
}

TEST(JobPool, ATreeWhoseMeshFitsGoesOnBehindALargeOneOfItsTenant) {
  WithTree large(30 * kMegabyte, 100 * kMegabyte);
  WithTree small(10 * kMegabyte, 40 * kMegabyte);
  Pool pool(2, 10, 10, kMaxMemory);
  absl::StatusOr<MemoryReservation> call = pool.memory.Reserve(40 * kMegabyte, "a call");
  ASSERT_TRUE(call.ok());
  for (WithTree* const job : {&large, &small}) {
    ASSERT_NE(pool.Submit(job->Work()), nullptr);
    ASSERT_TRUE(job->has_tree.Wait());
  }
  large.may_go_on.Set();
  small.may_go_on.Set();
  WaitForQueued(pool, 2);
  call->Release();  // for the small one, whose end makes room for the large one
  for (WithTree* const job : {&large, &small}) {
    ASSERT_TRUE(job->ended.Wait());
    EXPECT_TRUE(job->mesh_status.ok()) << job->mesh_status;
  }
}

TEST(JobPool, NoTreeIsBegunWithWhatOneThatWaitsNeeds) {
  Needy holder(40 * kMegabyte);
  WithTree waiting(30 * kMegabyte, 80 * kMegabyte);
  Needy begins(10 * kMegabyte);
  Pool pool(2, 10, 10, kMaxMemory);
  ASSERT_NE(pool.Submit(holder.Work(), "a"), nullptr);
  ASSERT_TRUE(holder.reserved.Wait());
  ASSERT_NE(pool.Submit(waiting.Work(), "b"), nullptr);
  waiting.may_go_on.Set();
  WaitForQueued(pool, 1);
  ASSERT_NE(pool.Submit(begins.Work(), "c"), nullptr);
  while (!begins.reserved.IsSet() && pool.GetLoad().queued < 2) {
    std::this_thread::yield();
  }
  EXPECT_FALSE(begins.reserved.IsSet());
  holder.may_end.Set();
  ASSERT_TRUE(waiting.ended.Wait());
  EXPECT_TRUE(waiting.mesh_status.ok()) << waiting.mesh_status;
  begins.may_end.Set();
  ASSERT_TRUE(begins.ended.Wait());
  EXPECT_TRUE(begins.status.ok()) << begins.status;
}

TEST(JobPool, CancelWhileWaitingForMemoryEndsTheWaitAtOnce) {
  Needy holder(60 * kMegabyte);
  Needy large(80 * kMegabyte);
  Pool pool(1, 10, 10, kMaxMemory);
  pool.Submit(holder.Work());
  ASSERT_TRUE(holder.began.Wait());
  ASSERT_TRUE(holder.reserved.Wait());
  // With one worker the large one could not even begin; memory that is held outside jobs makes it wait.
  holder.may_end.Set();
  ASSERT_TRUE(holder.ended.Wait());
  absl::StatusOr<MemoryReservation> call = pool.memory.Reserve(60 * kMegabyte, "a call");
  while (!call.ok()) {
    call = pool.memory.Reserve(60 * kMegabyte, "a call");
  }
  const std::shared_ptr<Job> job = pool.Submit(large.Work());
  ASSERT_TRUE(large.began.Wait());
  WaitForQueued(pool, 1);
  pool.Cancel(job);
  ASSERT_TRUE(large.ended.Wait());
  EXPECT_EQ(large.status.code(), absl::StatusCode::kCancelled);
}

TEST(JobPool, DestructionEndsThoseThatWaitForMemory) {
  Needy large(80 * kMegabyte);
  std::optional<Pool> pool(std::in_place, 1, 10, 10, kMaxMemory);
  absl::StatusOr<MemoryReservation> call = pool->memory.Reserve(60 * kMegabyte, "a call");
  ASSERT_TRUE(call.ok());
  pool->Submit(large.Work());
  ASSERT_TRUE(large.began.Wait());
  WaitForQueued(*pool, 1);
  call->Release();  // the budget goes with the pool: it may or may not be served before
  large.may_end.Set();
  pool.reset();
  EXPECT_TRUE(large.ended.IsSet());
}

TEST(JobPool, ManyTenantsWithTenTimesTheMemoryFinish) {
  constexpr int kTenants = 8;
  constexpr int kJobs = 50;
  std::atomic<uint64_t> most = 0;
  std::atomic<int> finished = 0;
  std::atomic<int> refused = 0;
  Pool pool(4, kTenants * kJobs, kJobs, kMaxMemory);
  std::vector<std::thread> threads;
  for (int t = 0; t < kTenants; ++t) {
    threads.emplace_back([&, t] {
      std::mt19937 generator(t);
      for (int i = 0; i < kJobs; ++i) {
        const uint64_t tree = (1 + generator() % 10) * kMegabyte;
        const uint64_t mesh = tree * (1 + generator() % 9);
        const auto work = [&, tree, mesh](Job& job) {
          absl::Status status = job.context().ReserveMemory(tree);
          if (status.ok()) {
            status = job.context().ReserveMemory(mesh);
          }
          uint64_t seen = most;
          const uint64_t now = pool.memory.reserved();
          while (seen < now && !most.compare_exchange_weak(seen, now)) {
          }
          ++(status.ok() ? finished : refused);
        };
        ASSERT_NE(pool.Submit(work, std::to_string(t)), nullptr);
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  while (finished + refused < kTenants * kJobs) {
    std::this_thread::yield();
  }
  EXPECT_LE(most, pool.memory.limit());
  // The demand of the first trees of all is not known yet. When four begin at once, they may get into a deadlock: 1 in
  // 3000 tests.
  EXPECT_GE(finished, kTenants * kJobs * 98 / 100);
  while (pool.GetLoad().running > 0) {
    std::this_thread::yield();
  }
  EXPECT_EQ(pool.memory.reserved(), 0u);
}

TEST(JobPool, SmallJobsAskForMemoryBesideThoseThatWaitForIt) {
  MemoryBudget memory(kMaxMemory);
  JobPool pool({.workers = 2, .max_queued = 10, .max_per_tenant = 100, .small_workers = 1}, memory);
  Needy holder(60 * kMegabyte);
  Needy waiting(80 * kMegabyte);
  ASSERT_TRUE(pool.Submit({.tenant = "a", .work = holder.Work()}).ok());
  ASSERT_TRUE(holder.reserved.Wait());
  ASSERT_TRUE(pool.Submit({.tenant = "b", .work = waiting.Work()}).ok());
  while (pool.GetLoad().queued != 1) {  // until it waits for memory
    std::this_thread::yield();
  }
  for (int i = 0; i < 3 * FairQueue::kMaxSkips; ++i) {
    Needy small(10 * kMegabyte);
    small.may_end.Set();
    ASSERT_TRUE(pool.Submit({.tenant = "c", .is_small = true, .work = small.Work()}).ok());
    ASSERT_TRUE(small.ended.Wait());
    EXPECT_TRUE(small.status.ok()) << small.status;
    while (pool.GetLoad().running > 1) {  // until it is gone
      std::this_thread::yield();
    }
  }
  holder.may_end.Set();
  ASSERT_TRUE(waiting.reserved.Wait());
  EXPECT_TRUE(waiting.status.ok()) << waiting.status;
  waiting.may_end.Set();
  ASSERT_TRUE(waiting.ended.Wait());
  ASSERT_TRUE(pool.WaitUntilIdle(absl::Minutes(1)));
}

}  // namespace
}  // namespace wellspace::server
