// Loops that threads share: each call is made once, and the writes of calls are seen after.
#include "core/base/thread_team.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <new>
#include <string>
#include <thread>
#include <vector>

namespace wellspace::core {
namespace {

constexpr size_t kCounts[] = {0, 1, 2, 7, 1000};

TEST(ThreadTeamTest, ForEachCallsOnceForEach) {
  for (const int threads : {1, 2, 4}) {
    ThreadTeam team(threads);
    for (const size_t count : kCounts) {
      std::vector<int> calls(count);
      team.ForEach(count, [&](size_t i) { ++calls[i]; });
      EXPECT_EQ(calls, std::vector<int>(count, 1));
    }
  }
}

TEST(ThreadTeamTest, BeginAndEndCallOnceForEachWhileTheCallerGoesOn) {
  for (const int threads : {1, 2, 4}) {
    ThreadTeam team(threads);
    for (int repeat = 0; repeat < 100; ++repeat) {
      for (const size_t count : kCounts) {
        std::vector<int> calls(count);
        std::vector<int> by_thread(count, -1);
        team.Begin(count, [&](size_t i) {
          ++calls[i];
          by_thread[i] = ThreadTeam::CurrentThread();
        });
        const std::vector<int> own(count, 1);
        team.End();
        EXPECT_EQ(calls, own);
        for (const int thread : by_thread) {
          EXPECT_GE(thread, 0);
          EXPECT_LT(thread, team.threads());
        }
      }
    }
  }
}

TEST(ThreadTeamTest, TryForEachReturnsTheFirstError) {
  for (const int threads : {1, 2}) {
    ThreadTeam team(threads);
    for (const size_t count : kCounts) {
      std::vector<int> calls(count);
      EXPECT_TRUE(team.TryForEach(count,
                                  [&](size_t i) {
                                    ++calls[i];
                                    return absl::OkStatus();
                                  })
                      .ok());
      EXPECT_EQ(calls, std::vector<int>(count, 1));
    }
    const absl::Status status = team.TryForEach(
        100, [](size_t i) { return i % 10 == 7 ? absl::InvalidArgumentError(std::to_string(i)) : absl::OkStatus(); });
    EXPECT_EQ(status, absl::InvalidArgumentError("7"));
    EXPECT_EQ(team.TryForEach(1, [](size_t) { return absl::CancelledError(); }), absl::CancelledError());
  }
}

TEST(ThreadTeamTest, EndWaitsForACallBesideALoop) {
  for (const int threads : {1, 2}) {
    ThreadTeam team(threads);
    for (int repeat = 0; repeat < 100; ++repeat) {
      int called = 0;
      team.BeginCall([&] { ++called; });
      if (repeat % 2 == 0) {
        std::vector<int> calls(10);
        team.Begin(calls.size(), [&](size_t i) { ++calls[i]; });
        team.End();
        EXPECT_EQ(calls, std::vector<int>(calls.size(), 1));
      } else {
        team.End();
      }
      EXPECT_EQ(called, 1);
    }
  }
}

TEST(ThreadTeamTest, OtherThreadsBeginBeforeEnd) {
  ThreadTeam team(2);
  if (team.threads() < 2) {
    GTEST_SKIP() << "one core";
  }
  std::atomic<bool> has_begun = false;
  team.Begin(1, [&](size_t) { has_begun = true; });
  while (!has_begun) {
  }
  team.End();
}

TEST(ThreadTeamTest, TheCallerMayHelpWithoutWaiting) {
  for (const int threads : {1, 2}) {
    ThreadTeam team(threads);
    std::vector<int> calls(100);
    std::atomic<bool> has_helped = false;
    const std::thread::id caller = std::this_thread::get_id();
    team.Begin(calls.size(), [&](size_t i) {
      while (i == 0 && std::this_thread::get_id() != caller && !has_helped) {
        // so that calls are left
      }
      ++calls[i];
    });
    EXPECT_TRUE(team.Help());
    has_helped = true;
    while (team.Help()) {
    }
    EXPECT_FALSE(team.Help());
    team.End();
    EXPECT_TRUE(team.HasEnded());
    EXPECT_EQ(calls, std::vector<int>(calls.size(), 1));
  }
}

TEST(ThreadTeamTest, WhatACallThrowsComesFromEnd) {
  ThreadTeam team(2);
  for (int repeat = 0; repeat < 20; ++repeat) {
    team.Begin(100, [](size_t i) {
      if (i % 10 == 7) {
        throw std::bad_alloc();
      }
    });
    EXPECT_THROW(team.End(), std::bad_alloc);
    std::atomic<int> calls = 0;
    team.Begin(100, [&](size_t) { ++calls; });
    team.End();
    EXPECT_EQ(calls, 100) << "the next loop is as always";
  }
}

TEST(ThreadTeamTest, DropLosesWhatIsThrown) {
  ThreadTeam team(2);
  std::atomic<size_t> calls = 0;
  team.Begin(1'000'000, [&](size_t) {
    ++calls;
    throw std::bad_alloc();
  });
  team.Drop();
  EXPECT_LE(calls, static_cast<size_t>(team.threads()));
  team.Begin(10, [&](size_t) { ++calls; });
  team.End();
  EXPECT_GE(calls, 10u);
}

// Calls that wait for one another are on two threads. The team's own has the clock that it has; the other's time is
// told when the team is no more.
TEST(ThreadTeamTest, TimeOfHelpersCountsAsThatOfTheirTeam) {
  const auto work_for = [](int64_t nanoseconds) {
    const int64_t begin = ThreadNanoseconds();
    while (ThreadNanoseconds() < begin + nanoseconds) {
    }
  };
  constexpr int64_t kWork = 20'000'000;
  const std::thread::id own = std::this_thread::get_id();
  const int64_t before = HelpersNanoseconds();
  {
    ThreadTeam team(2);
    if (team.threads() < 2) {
      GTEST_SKIP() << "this machine has one core";
    }
    std::atomic<bool> has_helped = false;
    team.BeginCall([&] {
      work_for(std::this_thread::get_id() == own ? 0 : kWork);
      has_helped = std::this_thread::get_id() != own;
    });
    while (!has_helped) {  // else End would make the call on this thread
      std::this_thread::yield();
    }
    team.End();
    EXPECT_EQ(HelpersNanoseconds(), before);
  }
  EXPECT_GE(HelpersNanoseconds(), before + kWork);
  EXPECT_LT(HelpersNanoseconds(), before + 10 * kWork) << "this thread's own time is not in it";
}

}  // namespace
}  // namespace wellspace::core
