#include "core/base/run_context.h"

#include <algorithm>

#include "absl/time/clock.h"

namespace wellspace::core {
namespace {

// The share of a run's time that has passed when a phase begins: rough, only for progress bars.
constexpr std::array<double, kPhaseCount> kPhaseStart = {0.0, 0.0, 0.05, 0.55, 0.6, 1.0};

}  // namespace

const char* PhaseName(Phase phase) {
  switch (phase) {
    case Phase::kWaiting:
      return "waiting";
    case Phase::kTree:
      return "tree";
    case Phase::kRefinement:
      return "refinement";
    case Phase::kSimplices:
      return "simplices";
    case Phase::kSlivers:
      return "slivers";
    case Phase::kDone:
      return "done";
  }
  return "unknown";
}

void RunContext::Cancel() {
  State expected = State::kRunning;
  state_.compare_exchange_strong(expected, State::kCancelled);
}

void RunContext::ExceedDeadline() {
  State expected = State::kRunning;
  state_.compare_exchange_strong(expected, State::kDeadlineExceeded);
}

absl::Status RunContext::Check() const {
  switch (state_.load(std::memory_order_relaxed)) {
    case State::kRunning:
      return absl::OkStatus();
    case State::kCancelled:
      return absl::CancelledError("the run was cancelled");
    case State::kDeadlineExceeded:
      return absl::DeadlineExceededError("the run's deadline passed");
  }
  return absl::InternalError("unknown run state");
}

Progress RunContext::Snapshot() const {
  Progress progress;
  progress.phase = phase_.load(std::memory_order_relaxed);
  progress.vertices = vertices_.load(std::memory_order_relaxed);
  const uint64_t estimate = estimated_vertices_.load(std::memory_order_relaxed);
  progress.estimated_vertices = estimate == 0 ? 0 : std::max(estimate, progress.vertices);
  progress.simplices = simplices_.load(std::memory_order_relaxed);
  progress.fraction = fraction_.load(std::memory_order_relaxed);
  return progress;
}

void RunContext::EnterPhase(Phase phase) {
  entered_ns_[static_cast<int>(phase)].store(absl::GetCurrentTimeNanos(), std::memory_order_relaxed);
  phase_.store(phase, std::memory_order_relaxed);
  SetPhaseFraction(0);
}

void RunContext::SetPhaseFraction(double done) {
  const int phase = static_cast<int>(phase_.load(std::memory_order_relaxed));
  const double begin = kPhaseStart[phase];
  const double end = phase + 1 < kPhaseCount ? kPhaseStart[phase + 1] : 1.0;
  const double fraction = begin + (end - begin) * (done < 0 ? 0 : done > 1 ? 1 : done);
  double seen = fraction_.load(std::memory_order_relaxed);
  while (seen < fraction && !fraction_.compare_exchange_weak(seen, fraction)) {
  }
}

absl::Duration RunContext::TimeIn(Phase phase) const {
  const int index = static_cast<int>(phase);
  const int64_t begin = entered_ns_[index].load(std::memory_order_relaxed);
  if (begin == 0) {
    return absl::ZeroDuration();
  }
  int64_t end = 0;
  for (int later = index + 1; later < kPhaseCount && end == 0; ++later) {
    const int64_t entered = entered_ns_[later].load(std::memory_order_relaxed);
    end = entered > begin ? entered : 0;  // earlier ones are of an earlier use of this context
  }
  return absl::Nanoseconds((end == 0 ? absl::GetCurrentTimeNanos() : end) - begin);
}

}  // namespace wellspace::core
