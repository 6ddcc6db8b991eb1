// The work done after a cancel, at any moment of a large run: reading, tree, refinement, simplices, slivers,
// sending. The time of the processor counts, which is that of the clock on a machine that does nothing else.
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "gtest/gtest.h"
#include "tests/server/patience.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

constexpr size_t kPiece = 96'000;                       // coordinates of a message, whole points in 2-D and 3-D
constexpr absl::Duration kPatience = absl::Minutes(4);  // with a run that is expected

absl::Duration ProcessorTime() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return absl::DurationFromTimespec(now);
}

// Cancels runs over one cloud at moments that the test chooses.
class CancelTest : public ::testing::Test {
 protected:
  // A mesher that lets the test look at its run.
  Mesher Watched() {
    return [this](const core::MeshParameters& parameters, const core::Input& input, core::RunContext& context) {
      run_ = &context;
      absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, input, context);
      run_ = nullptr;
      has_returned_ = true;
      return mesh;
    };
  }

  void Send(TestCall& call) {
    call.Send(UnitCubeParameters(dimension_));
    for (size_t begin = 0; begin < points_.size(); begin += kPiece) {
      const size_t end = std::min(points_.size(), begin + kPiece);
      ASSERT_TRUE(call.Send(std::vector<double>(points_.begin() + begin, points_.begin() + end)));
    }
    call.HalfClose();
  }

  // Waits, without work, until the run is in `phase` and has done `fraction` of all, or has ended.
  void WaitFor(core::Phase phase, double fraction) {
    const absl::Time give_up = absl::Now() + kPatience;
    while (!has_returned_) {
      ASSERT_LT(absl::Now(), give_up) << "no run came to " << core::PhaseName(phase);
      if (const core::RunContext* run = run_; run != nullptr) {
        const core::Progress progress = run->Snapshot();
        if (progress.phase > phase || (progress.phase == phase && progress.fraction >= fraction)) {
          return;
        }
      }
      absl::SleepFor(absl::Milliseconds(1));
    }
  }

  // Cancels, and says how long processors work until no job runs and the call has ended.
  absl::Duration Cancel(TestCall& call) {
    const absl::Duration begin = ProcessorTime();
    call.Cancel();
    EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::CANCELLED);
    while (harness_.Info().running_jobs() > 0) {
      absl::SleepFor(absl::Milliseconds(1));
    }
    return ProcessorTime() - begin;
  }

  void Expect(absl::Duration spent, const std::string& when) {
    std::printf("%s: %.1f ms\n", when.c_str(), absl::ToDoubleMilliseconds(spent));
    EXPECT_LE(spent, kIdleWithin) << when;
  }

  int dimension_ = 3;
  std::vector<double> points_;
  std::atomic<const core::RunContext*> run_ = nullptr;
  std::atomic<bool> has_returned_ = false;
  ServiceHarness harness_{Watched()};
};

TEST_F(CancelTest, WhileReadingALargeCloud) {
  points_ = RandomPoints(4'000'000, 3);
  TestCall call(harness_.stub());
  call.Send(UnitCubeParameters());
  for (size_t begin = 0; begin + kPiece <= points_.size(); begin += kPiece) {
    ASSERT_TRUE(call.Send(std::vector<double>(points_.begin() + begin, points_.begin() + begin + kPiece)));
  }
  Expect(Cancel(call), "reading");
}

// The tree has no fractions: a first run says how long it takes.
TEST_F(CancelTest, InTheTreeOfALargeCloud) {
  points_ = RandomPoints(3'000'000, 3);
  constexpr int kMoments = 12;
  absl::Duration tree_time;
  {
    TestCall call(harness_.stub());
    Send(call);
    WaitFor(core::Phase::kTree, 0);
    const absl::Time begin = absl::Now();
    WaitFor(core::Phase::kRefinement, 0);
    tree_time = absl::Now() - begin;
    Expect(Cancel(call), "tree, done");
  }
  for (int i = 0; i < kMoments; ++i) {
    has_returned_ = false;
    TestCall call(harness_.stub());
    Send(call);
    WaitFor(core::Phase::kTree, 0);
    absl::SleepFor(tree_time * i / kMoments);
    Expect(Cancel(call), "tree, " + std::to_string(i) + "/" + std::to_string(kMoments));
  }
}

TEST_F(CancelTest, InRefinementAndSimplicesOfALargeMesh) {
  dimension_ = 2;
  points_ = RandomPoints(200'000, 2);
  for (const double fraction : {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.66, 0.7, 0.8, 0.9, 0.95, 0.99}) {
    has_returned_ = false;
    TestCall call(harness_.stub());
    Send(call);
    WaitFor(core::Phase::kRefinement, fraction);
    const core::RunContext* run = run_;
    const std::string phase = run == nullptr ? "done" : core::PhaseName(run->Snapshot().phase);
    Expect(Cancel(call), phase + ", " + std::to_string(fraction));
  }
}

// Slivers are repaired by default.
TEST_F(CancelTest, InRepairOfALargeMesh) {
  points_ = RandomPoints(60'000, 3);
  for (const double fraction : {0.0, 0.82, 0.86, 0.9, 0.94, 0.98}) {
    has_returned_ = false;
    TestCall call(harness_.stub());
    Send(call);
    WaitFor(core::Phase::kSlivers, fraction);
    Expect(Cancel(call), "slivers, " + std::to_string(fraction));
  }
}

TEST_F(CancelTest, WhileSendingALargeMesh) {
  dimension_ = 2;
  points_ = RandomPoints(200'000, 2);
  TestCall call(harness_.stub());
  Send(call);
  v1::MeshPointsResponse response;
  do {
    ASSERT_TRUE(call.Read(&response));
  } while (!response.has_chunk());
  Expect(Cancel(call), "sending");
}

}  // namespace
}  // namespace wellspace::server
