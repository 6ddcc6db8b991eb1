#include "server/jobs.h"

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

void WorkUntilCancelled(Job& job) {
  while (!job.context().IsCancelled()) {
    std::this_thread::yield();
  }
}

// A pool, and submitting without ceremony: null when refused.
class Pool {
 public:
  Pool(int workers, int max_queued, int max_per_tenant = 1000, uint64_t max_memory_bytes = 0)
      : memory(max_memory_bytes),
        pool({.workers = workers, .max_queued = max_queued, .max_per_tenant = max_per_tenant}, memory) {}

  std::shared_ptr<Job> Submit(Job::Work work, const std::string& tenant = "default") {
    return pool.Submit({.tenant = tenant, .work = std::move(work)}).job;
  }
  void Cancel(const std::shared_ptr<Job>& job) { pool.Cancel(job); }
  JobPool::Load GetLoad() const { return pool.GetLoad(); }

  MemoryBudget memory;
  JobPool pool;
};

TEST(JobPool, RunsWhatWasSubmittedInOrder) {
  std::vector<int> order;
  Event done;
  Pool pool(1, 10);
  for (int i = 0; i < 5; ++i) {
    ASSERT_NE(pool.Submit([&order, &done, i](Job&) {
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
  Pool pool(2, 3);
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
  Pool pool(1, 0);
  EXPECT_NE(pool.Submit(WorkUntilCancelled), nullptr);
  EXPECT_EQ(pool.Submit(WorkUntilCancelled), nullptr);
}

TEST(JobPool, CancelBeforeStartNeverRunsTheWorkAndFreesIt) {
  std::atomic<bool> ran = false;
  auto held = std::make_shared<int>(0);
  Pool pool(1, 4);
  Event started;
  const std::shared_ptr<Job> blocker = pool.Submit([&started](Job& job) {
    started.Set();
    WorkUntilCancelled(job);
  });
  ASSERT_TRUE(started.Wait());
  const std::shared_ptr<Job> waiting = pool.Submit([&ran, held](Job&) { ran = true; });
  EXPECT_EQ(pool.GetLoad().queued, 1);
  EXPECT_EQ(held.use_count(), 2);
  pool.Cancel(waiting);
  EXPECT_EQ(held.use_count(), 1);
  EXPECT_EQ(pool.GetLoad().queued, 0);
  EXPECT_EQ(pool.GetLoad().running, 1);
  EXPECT_TRUE(waiting->context().IsCancelled());
  Event after;
  ASSERT_NE(pool.Submit([&after](Job&) { after.Set(); }), nullptr);
  pool.Cancel(blocker);
  ASSERT_TRUE(after.Wait());
  EXPECT_FALSE(ran);
}

TEST(JobPool, CancelWhileRunningCancelsTheContextAndFreesTheWorker) {
  Pool pool(1, 1);
  Event started;
  Event next;
  absl::Status seen;
  const std::shared_ptr<Job> job = pool.Submit([&](Job& running) {
    started.Set();
    WorkUntilCancelled(running);
    seen = running.context().Check();
  });
  ASSERT_TRUE(started.Wait());
  pool.Cancel(job);
  ASSERT_NE(pool.Submit([&next](Job&) { next.Set(); }), nullptr);
  ASSERT_TRUE(next.Wait());
  EXPECT_EQ(seen.code(), absl::StatusCode::kCancelled);
}

TEST(JobPool, CancelAfterTheEndDoesNoHarm) {
  Pool pool(1, 1);
  Event done;
  const std::shared_ptr<Job> job = pool.Submit([&done](Job&) { done.Set(); });
  ASSERT_TRUE(done.Wait());
  pool.Cancel(job);
  pool.Cancel(job);
}

TEST(JobPool, DestructionCancelsAndDrains) {
  std::atomic<bool> ended = false;
  std::atomic<bool> second_ran = false;
  std::optional<Pool> pool(std::in_place, 1, 4);
  Event started;
  pool->Submit([&](Job& job) {
    started.Set();
    WorkUntilCancelled(job);
    ended = true;
  });
  const std::shared_ptr<Job> second = pool->Submit([&](Job&) { second_ran = true; });
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
    Pool pool(2, 8);
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&pool, &ran] {
        for (int i = 0; i < kJobs; ++i) {
          const std::shared_ptr<Job> job = pool.Submit([&ran](Job&) { ++ran; });
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
    while (pool.Submit([&last_ran](Job&) { last_ran.Set(); }) == nullptr) {
      std::this_thread::yield();
    }
    EXPECT_TRUE(last_ran.Wait());
  }
  EXPECT_LE(ran, kThreads * kJobs);
}

}  // namespace
}  // namespace wellspace::server
