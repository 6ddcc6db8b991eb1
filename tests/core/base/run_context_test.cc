// Reasons to stop, progress and phases of a run, also with threads that race.
#include "core/base/run_context.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace wellspace::core {
namespace {

constexpr std::array kPhases = {Phase::kWaiting,   Phase::kTree,    Phase::kRefinement,
                                Phase::kSimplices, Phase::kSlivers, Phase::kDone};

TEST(RunContextTest, BeginsRunningAndWaiting) {
  const RunContext context;
  EXPECT_FALSE(context.IsCancelled());
  EXPECT_TRUE(context.Check().ok());
  const Progress progress = context.Snapshot();
  EXPECT_EQ(progress.phase, Phase::kWaiting);
  EXPECT_EQ(progress.vertices, 0u);
  EXPECT_EQ(progress.estimated_vertices, 0u);
  EXPECT_EQ(progress.simplices, 0u);
  EXPECT_EQ(progress.fraction, 0);
}

// Invariant (1).
TEST(RunContextTest, TheFirstReasonToStopIsTheOneReported) {
  RunContext cancelled;
  cancelled.Cancel();
  cancelled.ExceedDeadline();
  EXPECT_TRUE(cancelled.IsCancelled());
  EXPECT_EQ(cancelled.Check().code(), absl::StatusCode::kCancelled);

  RunContext late;
  late.ExceedDeadline();
  late.Cancel();
  EXPECT_TRUE(late.IsCancelled());
  EXPECT_EQ(late.Check().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(RunContextTest, RacingReasonsLeaveOne) {
  for (int i = 0; i < 50; ++i) {
    RunContext context;
    std::thread canceller([&] { context.Cancel(); });
    context.ExceedDeadline();
    const absl::StatusCode first = context.Check().code();
    canceller.join();
    EXPECT_EQ(context.Check().code(), first);
    EXPECT_TRUE(first == absl::StatusCode::kCancelled || first == absl::StatusCode::kDeadlineExceeded);
  }
}

TEST(RunContextTest, SnapshotShowsWhatTheMesherReports) {
  RunContext context;
  context.EnterPhase(Phase::kRefinement);
  context.SetVertices(7);
  context.SetEstimatedVertices(70);
  context.AddSimplices(5);
  context.AddSimplices(6);
  const Progress progress = context.Snapshot();
  EXPECT_EQ(progress.phase, Phase::kRefinement);
  EXPECT_EQ(progress.vertices, 7u);
  EXPECT_EQ(progress.estimated_vertices, 70u);
  EXPECT_EQ(progress.simplices, 11u);
}

// Invariant (2).
TEST(RunContextTest, FractionNeverDecreasesAndEndsAtOne) {
  RunContext context;
  double last = 0;
  for (const Phase phase : kPhases) {
    context.EnterPhase(phase);
    for (const double done : {0.0, 0.5, 0.25, 1.0, 0.0, -1.0, 2.0}) {
      context.SetPhaseFraction(done);
      const double fraction = context.Snapshot().fraction;
      EXPECT_GE(fraction, last);
      EXPECT_LE(fraction, 1);
      last = fraction;
    }
  }
  EXPECT_EQ(last, 1);
}

TEST(RunContextTest, FractionNeverDecreasesForAWatcherOfManyWorkers) {
  RunContext context;
  context.EnterPhase(Phase::kSlivers);
  std::atomic<int> working{2};
  std::vector<std::thread> workers;
  for (int offset = 0; offset < 2; ++offset) {
    workers.emplace_back([&, offset] {
      for (int i = offset; i <= 2000; i += 2) {
        context.SetPhaseFraction(i / 2000.0);
      }
      --working;
    });
  }
  double last = 0;
  bool has_decreased = false;
  while (working > 0) {
    const double fraction = context.Snapshot().fraction;
    has_decreased = has_decreased || fraction < last;
    last = fraction;
  }
  for (std::thread& worker : workers) {
    worker.join();
  }
  EXPECT_FALSE(has_decreased);
  EXPECT_EQ(context.Snapshot().fraction, 1);
}

TEST(RunContextTest, TimeIsCountedFromAPhasesBeginToTheNextOne) {
  RunContext context;
  for (const Phase phase : kPhases) {
    EXPECT_EQ(context.TimeIn(phase), absl::ZeroDuration());
  }
  context.EnterPhase(Phase::kTree);
  context.EnterPhase(Phase::kSimplices);  // a run may leave phases out
  const absl::Duration in_tree = context.TimeIn(Phase::kTree);
  EXPECT_EQ(context.TimeIn(Phase::kTree), in_tree) << "a phase that is over takes no more time";
  EXPECT_EQ(context.TimeIn(Phase::kRefinement), absl::ZeroDuration());
}

TEST(RunContextTest, PhasesHaveDifferentNames) {
  std::set<std::string> names;
  for (const Phase phase : kPhases) {
    names.insert(PhaseName(phase));
  }
  EXPECT_EQ(names, (std::set<std::string>{"waiting", "tree", "refinement", "simplices", "slivers", "done"}));
  EXPECT_EQ(static_cast<int>(kPhases.size()), kPhaseCount);
}

}  // namespace
}  // namespace wellspace::core
