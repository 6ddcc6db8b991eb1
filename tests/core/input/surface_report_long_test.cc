// Large surfaces: how long they take, and how soon a run that is cancelled ends. In processor time, which other work on
// the machine does not lengthen.
#include <gtest/gtest.h>
#include <time.h>

#include <atomic>
#include <thread>

#include "absl/time/clock.h"
#include "core/input/surface_report.h"
#include "tests/support/clouds.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

// Corners of CAD, flat patches of many triangles, and a sphere inside.
test::TestSurface Large(int depth) {
  test::TestSurface cube = test::Cube();
  for (int i = 0; i < depth; ++i) {
    cube = test::Subdivided(cube);
  }
  return test::Joined(cube, test::Sphere(depth, {0.5, 0.5, 0.5}, 0.4));
}

// Of all threads of this process.
absl::Duration ProcessorTime() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return absl::DurationFromTimespec(now);
}

TEST(SurfaceReportLong, AQuarterOfAMillionTrianglesTakeASecondAndAHalf) {
  const test::TestSurface surface =
      test::Joined(test::Joined(Large(6), test::Sphere(6, {3, 0, 0})), test::Sphere(5, {6, 0, 0}));
  ASSERT_GT(surface.triangle_count(), 230'000u);
  const absl::Duration start = ProcessorTime();
  const auto report = InspectSurface(surface.points, surface.Features(), 1, RunContext());
  const absl::Duration time = ProcessorTime() - start;
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->faults.empty());
  EXPECT_LT(time, absl::Seconds(1.5));
}

TEST(SurfaceReportLong, ARunOverAMillionTrianglesEndsWithinATenthOfASecond) {
  const test::TestSurface whole = test::Joined(Large(7), test::Sphere(7, {3, 0, 0}));
  test::SplitMix64 random(test::Seed(20'548));
  test::TestSurface noisy = whole;
  for (double& x : noisy.points) {
    x += 1e-4 * random.Gauss();
  }
  ASSERT_GT(whole.triangle_count(), 800'000u);
  for (const test::TestSurface& surface : {whole, noisy, test::Loose(whole)}) {
    SurfaceFeatures features = surface.Features();
    features.weld = 1e-9;
    const absl::Duration start = ProcessorTime();
    ASSERT_TRUE(InspectSurface(surface.points, features, 1, RunContext()).ok());
    const absl::Duration all = ProcessorTime() - start;
    constexpr int kRuns = 12;
    int cancelled_runs = 0;
    for (int run = 0; run < kRuns; ++run) {
      RunContext context;
      std::atomic<bool> has_ended = false;
      absl::Duration cancelled = absl::InfiniteDuration();
      const absl::Duration begun = ProcessorTime();
      std::thread canceller([&] {
        while (!has_ended && ProcessorTime() - begun < all * ((run + 0.5) / kRuns)) {
          absl::SleepFor(absl::Milliseconds(1));
        }
        cancelled = ProcessorTime();
        context.Cancel();
      });
      const auto report = InspectSurface(surface.points, features, 1, context);
      const absl::Duration ended = ProcessorTime();
      has_ended = true;
      canceller.join();
      if (!report.ok()) {
        ++cancelled_runs;
        EXPECT_EQ(report.status().code(), absl::StatusCode::kCancelled);
        EXPECT_LT(ended - cancelled, absl::Milliseconds(100)) << "after " << run << " of " << kRuns;
      }
    }
    EXPECT_GT(cancelled_runs, kRuns / 2);
  }
}

}  // namespace
}  // namespace wellspace::core
