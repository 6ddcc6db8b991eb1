#include "server/jobs.h"

#include <atomic>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

void WorkUntilCancelled(core::RunContext& context) {
  while (!context.IsCancelled()) {
    std::this_thread::yield();
  }
}

TEST(JobPool, RunsWhatWasSubmittedInOrder) {
  std::vector<int> order;
  Event done;
  JobPool pool(1, 10);
  for (int i = 0; i < 5; ++i) {
    ASSERT_NE(pool.Submit([&order, &done, i](core::RunContext&) {
      order.push_back(i);
      if (i == 4) {
        done.Set();
      }
    }),
              nullptr);
  }
  ASSERT_TRUE(done.Wait());
  EXPECT_EQ(order, std::vector<int>({0, 1, 2, 3, 4}));
}

TEST(JobPool, HoldsNoMoreThanWorkersAndQueue) {
  JobPool pool(2, 3);
  std::vector<std::shared_ptr<Job>> jobs;
  for (int i = 0; i < 5; ++i) {
    jobs.push_back(pool.Submit(WorkUntilCancelled));
    ASSERT_NE(jobs.back(), nullptr) << i;
  }
  EXPECT_EQ(pool.Submit(WorkUntilCancelled), nullptr);
  pool.Cancel(jobs.back());  // waits: two run and three wait
  EXPECT_NE(pool.Submit(WorkUntilCancelled), nullptr);
}

TEST(JobPool, WithoutQueueTakesAJobForEachWorker) {
  JobPool pool(1, 0);
  EXPECT_NE(pool.Submit(WorkUntilCancelled), nullptr);
  EXPECT_EQ(pool.Submit(WorkUntilCancelled), nullptr);
}

TEST(JobPool, CancelBeforeStartNeverRunsTheWorkAndFreesIt) {
  std::atomic<bool> ran = false;
  auto held = std::make_shared<int>(0);
  JobPool pool(1, 4);
  Event started;
  const std::shared_ptr<Job> blocker = pool.Submit([&started](core::RunContext& context) {
    started.Set();
    WorkUntilCancelled(context);
  });
  ASSERT_TRUE(started.Wait());
  const std::shared_ptr<Job> waiting = pool.Submit([&ran, held](core::RunContext&) { ran = true; });
  EXPECT_EQ(pool.GetLoad().queued, 1);
  EXPECT_EQ(held.use_count(), 2);
  pool.Cancel(waiting);
  EXPECT_EQ(held.use_count(), 1);
  EXPECT_EQ(pool.GetLoad().queued, 0);
  EXPECT_EQ(pool.GetLoad().running, 1);
  EXPECT_TRUE(waiting->context().IsCancelled());
  Event after;
  ASSERT_NE(pool.Submit([&after](core::RunContext&) { after.Set(); }), nullptr);
  pool.Cancel(blocker);
  ASSERT_TRUE(after.Wait());
  EXPECT_FALSE(ran);
}

TEST(JobPool, CancelWhileRunningCancelsTheContextAndFreesTheWorker) {
  JobPool pool(1, 1);
  Event started;
  Event next;
  absl::Status seen;
  const std::shared_ptr<Job> job = pool.Submit([&](core::RunContext& context) {
    started.Set();
    WorkUntilCancelled(context);
    seen = context.Check();
  });
  ASSERT_TRUE(started.Wait());
  pool.Cancel(job);
  ASSERT_NE(pool.Submit([&next](core::RunContext&) { next.Set(); }), nullptr);
  ASSERT_TRUE(next.Wait());
  EXPECT_EQ(seen.code(), absl::StatusCode::kCancelled);
}

TEST(JobPool, CancelAfterTheEndDoesNoHarm) {
  JobPool pool(1, 1);
  Event done;
  const std::shared_ptr<Job> job = pool.Submit([&done](core::RunContext&) { done.Set(); });
  ASSERT_TRUE(done.Wait());
  pool.Cancel(job);
  pool.Cancel(job);
}

TEST(JobPool, DestructionCancelsAndDrains) {
  std::atomic<bool> ended = false;
  std::atomic<bool> second_ran = false;
  std::optional<JobPool> pool(std::in_place, 1, 4);
  Event started;
  pool->Submit([&](core::RunContext& context) {
    started.Set();
    WorkUntilCancelled(context);
    ended = true;
  });
  const std::shared_ptr<Job> second = pool->Submit([&](core::RunContext&) { second_ran = true; });
  ASSERT_TRUE(started.Wait());
  pool.reset();
  EXPECT_TRUE(ended);
  EXPECT_FALSE(second_ran);
  EXPECT_TRUE(second->context().IsCancelled());
}

TEST(JobPool, ManyThreadsSubmitAndCancel) {
  constexpr int kThreads = 4;
  constexpr int kJobs = 200;
  std::atomic<int> ran = 0;
  {
    JobPool pool(2, 8);
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&pool, &ran] {
        for (int i = 0; i < kJobs; ++i) {
          const std::shared_ptr<Job> job = pool.Submit([&ran](core::RunContext&) { ++ran; });
          if (job != nullptr && i % 3 == 0) {
            pool.Cancel(job);
          }
          const JobPool::Load load = pool.GetLoad();
          EXPECT_LE(load.running, 2);
          EXPECT_LE(load.running + load.queued, 10);
        }
      });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    // The workers have survived: as soon as there is room, a job runs.
    Event last_ran;
    while (pool.Submit([&last_ran](core::RunContext&) { last_ran.Set(); }) == nullptr) {
      std::this_thread::yield();
    }
    EXPECT_TRUE(last_ran.Wait());
  }
  EXPECT_LE(ran, kThreads * kJobs);
}

}  // namespace
}  // namespace wellspace::server
