// Which progress becomes an event, by a clock of the test.
#include "server/sessions/progress_pacer.h"

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

core::Progress ProgressAt(core::Phase phase, uint64_t vertices, double fraction) {
  core::Progress progress;
  progress.phase = phase;
  progress.vertices = vertices;
  progress.fraction = fraction;
  return progress;
}

TEST(ProgressPacer, AtMostTenEventsASecond) {
  ProgressPacer pacer;
  int events = 0;
  uint64_t next_sequence = 0;
  for (int ms = 0; ms < 10'000; ++ms) {  // something new every millisecond
    const core::Progress progress = ProgressAt(core::Phase::kRefinement, ms, ms / 10'000.0);
    if (const auto event = pacer.Next(progress, absl::Milliseconds(ms))) {
      ++events;
      EXPECT_EQ(event->sequence(), next_sequence++);
    }
  }
  EXPECT_EQ(events, 100);
}

TEST(ProgressPacer, HeartbeatInEveryPhase) {
  for (int phase = 0; phase < core::kPhaseCount; ++phase) {
    ProgressPacer pacer;
    const core::Progress progress = ProgressAt(static_cast<core::Phase>(phase), 5, 0.5);
    absl::Duration last = absl::ZeroDuration();
    int events = 0;
    for (int ms = 0; ms < 10'000; ms += 100) {
      const absl::Duration now = absl::Milliseconds(ms);
      if (pacer.Next(progress, now)) {
        ++events;
        EXPECT_LT(now - last, absl::Seconds(2));
        last = now;
      }
    }
    EXPECT_EQ(events, 10);
  }
}

TEST(ProgressPacer, NeverGoesBack) {
  ProgressPacer pacer;
  const absl::Duration start = absl::ZeroDuration();
  ASSERT_TRUE(pacer.Next(ProgressAt(core::Phase::kSimplices, 100, 0.9), start));
  const auto event = pacer.Next(ProgressAt(core::Phase::kRefinement, 50, 0.1), start + absl::Seconds(5));
  ASSERT_TRUE(event);
  EXPECT_EQ(event->phase(), v1::PHASE_SIMPLICES);
  EXPECT_EQ(event->vertices(), 100u);
  EXPECT_EQ(event->fraction(), 0.9);
}

// Phases were not numbered in the order in which they come.
TEST(ProgressPacer, AfterTheSliversComesTheEnd) {
  ProgressPacer pacer;
  ASSERT_TRUE(pacer.Next(ProgressAt(core::Phase::kSlivers, 100, 0.9), absl::ZeroDuration()));
  const auto event = pacer.Next(ProgressAt(core::Phase::kDone, 100, 1), absl::ZeroDuration() + absl::Seconds(1));
  ASSERT_TRUE(event);
  EXPECT_EQ(event->phase(), v1::PHASE_DONE);
}

TEST(ProgressPacer, FinalEventAlways) {
  ProgressPacer pacer;
  ASSERT_TRUE(pacer.Next(ProgressAt(core::Phase::kTree, 1, 0.1), absl::ZeroDuration()));
  const v1::ProgressEvent event = pacer.Final(ProgressAt(core::Phase::kTree, 1, 0.1));
  EXPECT_EQ(event.phase(), v1::PHASE_DONE);
  EXPECT_EQ(event.fraction(), 1);
  EXPECT_EQ(event.sequence(), 1u);
}

}  // namespace
}  // namespace wellspace::server
