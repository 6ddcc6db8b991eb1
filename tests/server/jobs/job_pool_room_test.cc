// Jobs that wait for memory which idle sessions have.
#include <atomic>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include "server/jobs/job_pool.h"
#include "tests/server/jobs/test_jobs.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

// Memory that sessions have reserved until it is wanted; all are idle from the start, or once they are told.
class Sessions {
 public:
  explicit Sessions(MemoryBudget& memory) : memory_(memory) {
    memory_.SetGiveUp([this](uint64_t missing, MemoryBudget::Want want) { return GiveUp(missing, want); });
  }
  ~Sessions() { memory_.SetGiveUp(nullptr); }

  void Hold(uint64_t bytes, bool is_idle = true) {
    MemoryReservation held = memory_.Reserve(bytes, "a session").value();
    held.MakeLasting(Lasts::kUntilWanted);
    std::lock_guard lock(mutex_);
    (is_idle ? idle_ : busy_).push_back(std::move(held));
  }

  void BecomeIdle() {
    {
      std::lock_guard lock(mutex_);
      for (MemoryReservation& held : busy_) {
        idle_.push_back(std::move(held));
      }
      busy_.clear();
    }
    memory_.NoteIdle();
  }

  int asked() const { return asked_; }

 private:
  bool GiveUp(uint64_t missing, MemoryBudget::Want want) {
    ++asked_;
    std::vector<MemoryReservation> given;
    std::lock_guard lock(mutex_);
    uint64_t all = 0;
    for (const MemoryReservation& held : idle_) {
      all += held.bytes();
    }
    if (all < missing && want == MemoryBudget::Want::kAllOrNothing) {
      return all > 0;
    }
    for (uint64_t freed = 0; freed < missing && !idle_.empty(); idle_.pop_back()) {
      freed += idle_.back().bytes();
      given.push_back(std::move(idle_.back()));
    }
    return !idle_.empty();
  }

  MemoryBudget& memory_;
  std::mutex mutex_;
  std::vector<MemoryReservation> idle_;
  std::vector<MemoryReservation> busy_;
  std::atomic<int> asked_{0};
};

TEST(JobPoolRoom, AJobHasIdleSessionsGiveUpWhatItLacks) {
  Needy job(80 * kMegabyte);
  Pool pool(1, 1, 1, kMaxMemory);
  Sessions sessions(pool.memory);
  for (int i = 0; i < 4; ++i) {
    sessions.Hold(20 * kMegabyte);
  }
  sessions.BecomeIdle();
  job.may_end.Set();
  ASSERT_NE(pool.Submit(job.Work()), nullptr);
  ASSERT_TRUE(job.ended.Wait());
  EXPECT_TRUE(job.status.ok()) << job.status;
  EXPECT_EQ(pool.memory.yielding(), 20 * kMegabyte) << "one had not to give up anything";
}

TEST(JobPoolRoom, AJobThatRunsMayGrowIntoWhatIdleSessionsHave) {
  Pool pool(1, 1, 1, kMaxMemory);
  Sessions sessions(pool.memory);
  sessions.Hold(60 * kMegabyte);
  sessions.BecomeIdle();
  Event ended;
  absl::Status within;
  absl::Status beyond;
  ASSERT_NE(pool.Submit([&](Job& job) {
    within = job.context().AllowMemory(90 * kMegabyte);
    beyond = job.context().AllowMemory(101 * kMegabyte);
    ended.Set();
  }),
            nullptr);
  ASSERT_TRUE(ended.Wait());
  EXPECT_TRUE(within.ok()) << within;
  EXPECT_EQ(DetailsOf(beyond).reason, "MEMORY_LIMIT");
}

TEST(JobPoolRoom, AJobWaitsForASessionThatIsBusyAndGoesOnWhenThatIsIdle) {
  Needy holder(10 * kMegabyte);
  Needy job(80 * kMegabyte);
  Pool pool(2, 2, 2, kMaxMemory);
  Sessions sessions(pool.memory);
  sessions.Hold(60 * kMegabyte, /*is_idle=*/false);
  ASSERT_NE(pool.Submit(holder.Work()), nullptr);  // as the operation of that session
  ASSERT_TRUE(holder.reserved.Wait());
  ASSERT_NE(pool.Submit(job.Work()), nullptr);
  WaitForQueued(pool, 1);
  EXPECT_FALSE(job.reserved.IsSet());
  sessions.BecomeIdle();
  ASSERT_TRUE(job.reserved.Wait());
  EXPECT_TRUE(job.status.ok()) << job.status;
  EXPECT_EQ(pool.memory.yielding(), 0u);
  holder.may_end.Set();
  job.may_end.Set();
  ASSERT_TRUE(job.ended.Wait());
}

TEST(JobPoolRoom, WhatIdleSessionsHaveGoesToOneThatWaitsAlsoIfItIsNotEnoughYet) {
  Needy holder(30 * kMegabyte);
  Needy job(90 * kMegabyte);
  Pool pool(2, 2, 2, kMaxMemory);
  Sessions sessions(pool.memory);
  sessions.Hold(50 * kMegabyte);
  sessions.BecomeIdle();
  ASSERT_NE(pool.Submit(holder.Work()), nullptr);
  ASSERT_TRUE(holder.reserved.Wait());
  ASSERT_NE(pool.Submit(job.Work()), nullptr);
  while (pool.memory.yielding() > 0) {
    std::this_thread::yield();
  }
  EXPECT_FALSE(job.reserved.IsSet());
  holder.may_end.Set();
  ASSERT_TRUE(job.reserved.Wait());
  EXPECT_TRUE(job.status.ok()) << job.status;
  job.may_end.Set();
  ASSERT_TRUE(job.ended.Wait());
}

TEST(JobPoolRoom, NoneIsRefusedForATreeThatFitsOnceSessionsGiveUp) {
  // Without the sessions, both could go on one after the other.
  WithTree jobs[] = {{20 * kMegabyte, 60 * kMegabyte}, {20 * kMegabyte, 60 * kMegabyte}};
  Pool pool(2, 10, 10, kMaxMemory);
  Sessions sessions(pool.memory);
  sessions.Hold(60 * kMegabyte);
  sessions.BecomeIdle();
  for (WithTree& job : jobs) {
    ASSERT_NE(pool.Submit(job.Work(), std::to_string(&job - jobs)), nullptr);
    ASSERT_TRUE(job.has_tree.Wait());
  }
  for (WithTree& job : jobs) {
    job.may_go_on.Set();
  }
  for (WithTree& job : jobs) {
    ASSERT_TRUE(job.ended.Wait());
    EXPECT_TRUE(job.mesh_status.ok()) << job.mesh_status;
  }
}

TEST(JobPoolRoom, WhereSessionsHaveNothingMoreAVictimIsRefusedAsBefore) {
  WithTree jobs[] = {{30 * kMegabyte, 95 * kMegabyte}, {30 * kMegabyte, 95 * kMegabyte}};
  Pool pool(2, 10, 10, kMaxMemory);
  Sessions sessions(pool.memory);
  sessions.Hold(20 * kMegabyte);
  sessions.BecomeIdle();
  for (WithTree& job : jobs) {
    ASSERT_NE(pool.Submit(job.Work(), std::to_string(&job - jobs)), nullptr);
    ASSERT_TRUE(job.has_tree.Wait());
  }
  for (WithTree& job : jobs) {
    job.may_go_on.Set();
  }
  for (WithTree& job : jobs) {
    ASSERT_TRUE(job.ended.Wait());
  }
  EXPECT_TRUE(jobs[0].mesh_status.ok()) << jobs[0].mesh_status;
  EXPECT_EQ(DetailsOf(jobs[1].mesh_status).reason, "MEMORY_LIMIT");
  EXPECT_EQ(pool.memory.yielding(), 0u);
}

TEST(JobPoolRoom, SessionsAreNotAskedAgainBeforeOneIsIdle) {
  Needy holder(60 * kMegabyte);
  Needy large(80 * kMegabyte);
  Pool pool(2, 20, 20, kMaxMemory);
  Sessions sessions(pool.memory);
  sessions.BecomeIdle();
  ASSERT_NE(pool.Submit(holder.Work(), "a"), nullptr);
  ASSERT_TRUE(holder.reserved.Wait());
  ASSERT_NE(pool.Submit(large.Work(), "b"), nullptr);
  WaitForQueued(pool, 1);
  for (int i = 0; i < 5; ++i) {  // each releases memory at its end
    Needy small(kMegabyte);
    small.may_end.Set();
    ASSERT_NE(pool.Submit(small.Work(), "c"), nullptr);
    ASSERT_TRUE(small.ended.Wait());
  }
  EXPECT_EQ(sessions.asked(), 1);
  holder.may_end.Set();
  large.may_end.Set();
  ASSERT_TRUE(large.ended.Wait());
}

TEST(JobPoolRoom, AJobThatIsCancelledMeanwhileEnds) {
  for (int round = 0; round < 200; ++round) {
    Needy holder(60 * kMegabyte);
    Needy job(80 * kMegabyte);
    Pool pool(2, 2, 2, kMaxMemory);
    Sessions sessions(pool.memory);
    sessions.Hold(20 * kMegabyte, /*is_idle=*/false);
    ASSERT_NE(pool.Submit(holder.Work(), "a"), nullptr);
    ASSERT_TRUE(holder.reserved.Wait());
    const std::shared_ptr<Job> submitted = pool.Submit(job.Work(), "b");
    WaitForQueued(pool, 1);
    std::thread idle([&] { sessions.BecomeIdle(); });
    pool.Cancel(submitted);
    ASSERT_TRUE(job.ended.Wait());
    EXPECT_TRUE(absl::IsCancelled(job.status)) << job.status;
    idle.join();
    holder.may_end.Set();
    ASSERT_TRUE(holder.ended.Wait());
  }
}

}  // namespace
}  // namespace wellspace::server
