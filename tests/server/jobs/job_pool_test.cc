// Order, limits, cancel and end of jobs on the threads of a pool.
#include "server/jobs/job_pool.h"

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "gtest/gtest.h"
#include "tests/server/jobs/test_jobs.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

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

TEST(JobPool, OneThatRunsAloneHasNoOtherBesideIt) {
  MemoryBudget memory(0);
  JobPool pool({.workers = 2, .max_queued = 10, .max_per_tenant = 10, .small_workers = 2, .run_by = RunBy::kCaller},
               memory);
  std::string order;
  const auto submit = [&](const std::string& name, bool is_alone, bool is_small, const std::function<void()>& work) {
    return pool
        .Submit({.tenant = "default",
                 .is_small = is_small,
                 .is_alone = is_alone,
                 .work =
                     [&order, name, work](Job&) {
                       order += name;
                       work();
                     }})
        .value();
  };
  const auto nothing = [] {};
  const auto run_others = [&] {
    while (pool.RunNext()) {
    }
    order += ".";
  };
  submit("a", false, false, run_others);
  submit("b", false, false, nothing);
  submit("c", false, false, nothing);  // waits for a worker
  submit("d", true, false, run_others);
  const std::shared_ptr<Job> cancelled = submit("e", true, true, nothing);
  submit("f", true, true, run_others);
  submit("g", false, true, nothing);
  pool.Cancel(cancelled);
  EXPECT_TRUE(pool.RunNext());
  EXPECT_EQ(order, "ab.") << "what has begun ends before it";
  EXPECT_TRUE(pool.RunNext());
  EXPECT_EQ(order, "ab.d.") << "nothing begins beside it";
  EXPECT_TRUE(pool.RunNext());
  EXPECT_EQ(order, "ab.d.f.");
  run_others();
  EXPECT_TRUE(order == "ab.d.f.cg." || order == "ab.d.f.gc.") << order;
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

TEST(JobPool, TenantsTakeTurns) {
  std::vector<std::string> order;
  Event go;
  Event done;
  Pool pool(1, 20);
  ASSERT_NE(pool.Submit([&go](Job&) { EXPECT_TRUE(go.Wait()); }, "first"), nullptr);
  const auto submit = [&](const std::string& tenant, int number) {
    ASSERT_NE(pool.Submit(
                  [&order, &done, tenant, number](Job&) {
                    order.push_back(tenant + std::to_string(number));
                    if (order.size() == 7) {
                      done.Set();
                    }
                  },
                  tenant),
              nullptr);
  };
  for (int i = 0; i < 4; ++i) {
    submit("a", i);
  }
  submit("b", 0);
  submit("b", 1);
  submit("c", 0);
  go.Set();
  ASSERT_TRUE(done.Wait());
  EXPECT_EQ(order, std::vector<std::string>({"a0", "b0", "c0", "a1", "b1", "a2", "a3"}));
}

TEST(JobPool, RefusesWhatIsAboveATenantsShareAndTakesThoseOfOthers) {
  Pool pool(1, 10, 2);
  ASSERT_NE(pool.Submit(WorkUntilCancelled, "a"), nullptr);
  const std::shared_ptr<Job> second = pool.Submit(WorkUntilCancelled, "a");
  ASSERT_NE(second, nullptr);
  const absl::Status refused = pool.pool.Submit({.tenant = "a", .work = WorkUntilCancelled}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(DetailsOf(refused).reason, "QUOTA_EXCEEDED");
  EXPECT_TRUE(DetailsOf(refused).may_retry);
  EXPECT_NE(pool.Submit(WorkUntilCancelled, "b"), nullptr);
  pool.Cancel(second);
  EXPECT_NE(pool.Submit(WorkUntilCancelled, "a"), nullptr);
}

TEST(JobPool, KnowsForWhoseJobsThereIsRoom) {
  MemoryBudget memory(0);
  JobPool pool({.workers = 2, .max_queued = 10, .max_per_tenant = 2, .small_workers = 1, .run_by = RunBy::kCaller},
               memory);
  const auto submit = [&](const std::string& tenant, bool is_small, bool is_alone = false) {
    return pool.Submit({.tenant = tenant, .is_small = is_small, .is_alone = is_alone, .work = [](Job&) {}}).value();
  };
  EXPECT_EQ(pool.GetRoom().jobs, 2);
  EXPECT_TRUE(pool.GetRoom().full_tenants.empty());
  submit("a", false);
  submit("b", true);
  EXPECT_EQ(pool.GetRoom().jobs, 0) << "a small job has the second worker";
  submit("b", true);
  EXPECT_EQ(pool.GetRoom().full_tenants, std::vector<std::string>{"b"});
  submit("a", false);  // waits
  EXPECT_EQ(pool.GetRoom().jobs, 0);
  EXPECT_EQ(pool.GetRoom().full_tenants, (std::vector<std::string>{"a", "b"}));
  while (pool.RunNext()) {
  }
  EXPECT_EQ(pool.GetRoom().jobs, 2);
  const std::shared_ptr<Job> alone = submit("a", false, /*is_alone=*/true);
  EXPECT_EQ(pool.GetRoom().jobs, 0) << "nothing begins beside it";
  EXPECT_TRUE(pool.RunNext());
  EXPECT_EQ(pool.GetRoom().jobs, 2);
}

TEST(JobPool, AFullQueueSaysHowFull) {
  Pool pool(1, 0);
  ASSERT_NE(pool.Submit(WorkUntilCancelled), nullptr);
  const absl::Status refused = pool.pool.Submit({.tenant = "a", .work = WorkUntilCancelled}).status();
  EXPECT_EQ(DetailsOf(refused).reason, "QUEUE_FULL");
  EXPECT_TRUE(absl::StrContains(refused.message(), "runs 1 jobs and has 0 more in line")) << refused;
}

TEST(JobPool, IsIdleWhenNoJobRunsOrWaits) {
  Pool pool(1, 10);
  EXPECT_TRUE(pool.pool.WaitUntilIdle(absl::ZeroDuration()));
  Event go;
  ASSERT_NE(pool.Submit([&go](Job&) { EXPECT_TRUE(go.Wait()); }), nullptr);
  std::atomic<bool> has_ended = false;
  ASSERT_NE(pool.Submit([&has_ended](Job&) { has_ended = true; }), nullptr);
  EXPECT_FALSE(pool.pool.WaitUntilIdle(absl::Milliseconds(1)));
  go.Set();
  EXPECT_TRUE(pool.pool.WaitUntilIdle(absl::Minutes(1)));
  EXPECT_TRUE(has_ended);
}

TEST(JobPool, WithoutSmallWorkersSmallJobsAreAsOthers) {
  MemoryBudget memory(0);
  JobPool pool({.workers = 1, .max_queued = 0, .max_per_tenant = 10}, memory);
  ASSERT_TRUE(pool.Submit({.tenant = "a", .work = WorkUntilCancelled}).ok());
  EXPECT_FALSE(pool.Submit({.tenant = "b", .is_small = true, .work = WorkUntilCancelled}).ok());
}

// A pool with workers for small jobs, where large ones of tenant "large" have all workers and all places in the queue.
class BesideLargeJobs : public ::testing::Test {
 protected:
  static constexpr int kWorkers = 2;
  static constexpr int kQueued = 4;

  BesideLargeJobs() {
    for (int i = 0; i < kWorkers + kQueued; ++i) {
      EXPECT_TRUE(Submit("large", false, WorkUntilCancelled).ok());
    }
  }

  absl::StatusOr<std::shared_ptr<Job>> Submit(const std::string& tenant, bool is_small, Job::Work work) {
    return pool_.Submit({.tenant = tenant, .is_small = is_small, .work = std::move(work)});
  }
  void RunSmall(const std::string& tenant) {
    Event ran;
    ASSERT_TRUE(Submit(tenant, true, [&ran](Job&) { ran.Set(); }).ok());
    ASSERT_TRUE(ran.Wait());
    while (pool_.GetLoad().running > kWorkers) {  // until its worker is free
      std::this_thread::yield();
    }
  }

  MemoryBudget memory_{0};
  JobPool pool_{{.workers = kWorkers, .max_queued = kQueued, .max_per_tenant = kWorkers + kQueued, .small_workers = 1},
                memory_};
};

TEST_F(BesideLargeJobs, SmallOnesWaitForNoneOfThem) {
  EXPECT_EQ(DetailsOf(Submit("other", false, WorkUntilCancelled).status()).reason, "QUEUE_FULL");
  constexpr int kSmall = 100;
  for (int i = 0; i < kSmall; ++i) {
    RunSmall(i % 3 == 0 ? "large" : "small");
  }
  EXPECT_EQ(pool_.GetLoad().running, kWorkers);
  EXPECT_EQ(pool_.GetLoad().queued, kQueued);
  EXPECT_EQ(pool_.GetCounters().small.jobs, kSmall) << "none waited for the turn of a large one:";
  EXPECT_EQ(pool_.GetCounters().others.jobs, kWorkers)
      << "no large one was begun meanwhile, on a small worker least of all";
  EXPECT_GE(pool_.GetCounters().small.waited, pool_.GetCounters().small.longest);
}

TEST_F(BesideLargeJobs, SmallOnesTakeTurnsAmongThemselves) {
  Event runs;
  Event go;
  ASSERT_TRUE(Submit("a", true, [&](Job&) {
                runs.Set();
                EXPECT_TRUE(go.Wait());
              }).ok());
  ASSERT_TRUE(runs.Wait());
  std::vector<std::string> order;
  Event done;
  for (const std::string tenant : {"a", "a", "large", "b"}) {
    ASSERT_TRUE(Submit(tenant, true, [&order, &done, tenant](Job&) {
                  order.push_back(tenant);
                  if (order.size() == 4) {
                    done.Set();
                  }
                }).ok());
  }
  EXPECT_EQ(DetailsOf(Submit("c", true, WorkUntilCancelled).status()).reason, "QUEUE_FULL") << "their places end, too";
  go.Set();
  ASSERT_TRUE(done.Wait());
  EXPECT_EQ(order, std::vector<std::string>({"large", "a", "b", "a"})) << "the oldest turn is that of \"large\"";
}

}  // namespace
}  // namespace wellspace::server
