// A job's memory and its cancel.
#include "server/jobs/job.h"

#include <memory>
#include <thread>
#include <utility>

#include "gtest/gtest.h"
#include "server/jobs/job_pool.h"
#include "tests/server/jobs/test_jobs.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

TEST(Job, AJobThatOutgrowsItsReservationTakesWhatIsLeftThenEnds) {
  absl::Status less;
  absl::Status more;
  absl::Status all;
  Event ended;
  Pool pool(1, 1, 1, kMaxMemory);
  pool.Submit([&](Job& job) {
    EXPECT_TRUE(job.context().ReserveMemory(10 * kMegabyte).ok());
    less = job.context().AllowMemory(9 * kMegabyte);
    more = job.context().AllowMemory(100 * kMegabyte);
    all = job.context().AllowMemory(100 * kMegabyte + 1);
    ended.Set();
  });
  ASSERT_TRUE(ended.Wait());
  EXPECT_TRUE(less.ok()) << less;
  EXPECT_TRUE(more.ok()) << more;
  EXPECT_EQ(DetailsOf(all).reason, "MEMORY_LIMIT");
}

TEST(Job, WhatTheWorkHoldsIsReleasedWithIt) {
  Event done;
  Pool pool(1, 1, 1, kMaxMemory);
  absl::StatusOr<MemoryReservation> held = pool.memory.Reserve(10 * kMegabyte, "points");
  ASSERT_TRUE(held.ok());
  MemoryReservation kept;
  const auto work = [&](Job& job) {
    EXPECT_TRUE(job.context().ReserveMemory(20 * kMegabyte).ok());
    EXPECT_EQ(pool.memory.reserved(), 30 * kMegabyte);
    kept = job.TakeMemory(5 * kMegabyte);
    done.Set();
  };
  ASSERT_TRUE(pool.pool.Submit({.tenant = "a", .held = *std::move(held), .work = work}).ok());
  ASSERT_TRUE(done.Wait());
  while (pool.GetLoad().running > 0) {
    std::this_thread::yield();
  }
  EXPECT_EQ(pool.memory.reserved(), 5 * kMegabyte);
  kept.Release();
  EXPECT_EQ(pool.memory.reserved(), 0u);
}

// Work that a job runs apart is cancelled with it.
TEST(Job, CancelReachesWhatRunsApart) {
  Pool pool(1, 10);
  Event runs;
  Event ended;
  absl::Status status;
  const std::shared_ptr<Job> job = pool.Submit([&](Job& self) {
    status = self.RunApart([&](core::RunContext& apart) {
      runs.Set();
      while (!apart.IsCancelled()) {
        std::this_thread::yield();
      }
      return apart.Check();
    });
    ended.Set();
  });
  ASSERT_TRUE(runs.Wait());
  pool.Cancel(job);
  ASSERT_TRUE(ended.Wait());
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::server
