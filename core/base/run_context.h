// The state that a run shares with its caller: cancellation one way, progress the other.
#ifndef WELLSPACE_CORE_BASE_RUN_CONTEXT_H_
#define WELLSPACE_CORE_BASE_RUN_CONTEXT_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace wellspace::core {

enum class Phase : int { kWaiting = 0, kTree, kRefinement, kSimplices, kSlivers, kDone };
inline constexpr int kPhaseCount = 6;

// Steps of a few nanoseconds between two looks at the context.
inline constexpr size_t kStepsBetweenChecks = size_t{1} << 16;

// "waiting", "tree", "refinement", "simplices", "slivers", "done".
const char* PhaseName(Phase phase);

struct Progress {
  Phase phase = Phase::kWaiting;
  uint64_t vertices = 0;            // in the mesh so far
  uint64_t estimated_vertices = 0;  // of the finished mesh, roughly; 0 while unknown
  uint64_t simplices = 0;           // so far
  double fraction = 0;              // of the whole run, in [0, 1], never decreasing
};

// Lends runs their memory. Both calls count all the memory that a run holds, its input excepted.
//
// Thread safety: thread-safe.
class MemoryLender {
 public:
  virtual ~MemoryLender() = default;

  // Asked before work that is estimated to hold `bytes` at its peak. May wait until they can be had; an error ends the
  // run.
  virtual absl::Status Reserve(uint64_t bytes) = 0;

  // Asked now and then while a run works, with the bytes that it holds or is about to. Does not wait; an error ends it.
  virtual absl::Status Allow(uint64_t bytes) = 0;
};

// One run of the mesher: its owner cancels it and looks at its progress, the mesher polls it at checkpoints.
//
// Thread safety: thread-safe. Cancel and Snapshot may be called from any thread at any time.
// Invariants: (1) the first cancellation's reason is the one reported; (2) Snapshot().fraction never decreases.
class RunContext {
 public:
  RunContext() = default;
  RunContext(const RunContext&) = delete;
  RunContext& operator=(const RunContext&) = delete;

  // Asks the run to stop. The run then returns `Cancelled` or `DeadlineExceeded`. The second is for owners with a
  // deadline of their own: a call of the server whose deadline passes ends by itself, and cancels its run.
  void Cancel();
  void ExceedDeadline();

  bool IsCancelled() const { return state_.load(std::memory_order_relaxed) != State::kRunning; }

  // Ok while the run may go on, else why it may not. Cheap enough for every few microseconds; loops of shorter steps
  // call it every kStepsBetweenChecks.
  absl::Status Check() const;

  Progress Snapshot() const;

  // The lender of the run's memory; null, as at first: the run may have all there is. To be set before the run.
  void SetMemoryLender(MemoryLender* lender) { lender_ = lender; }
  bool HasMemoryLender() const { return lender_ != nullptr; }
  absl::Status ReserveMemory(uint64_t bytes) const {
    return lender_ == nullptr ? absl::OkStatus() : lender_->Reserve(bytes);
  }
  absl::Status AllowMemory(uint64_t bytes) const {
    return lender_ == nullptr ? absl::OkStatus() : lender_->Allow(bytes);
  }

  // For the mesher alone.
  void EnterPhase(Phase phase);
  void SetVertices(uint64_t vertices) { vertices_.store(vertices, std::memory_order_relaxed); }
  void SetEstimatedVertices(uint64_t vertices) { estimated_vertices_.store(vertices, std::memory_order_relaxed); }
  uint64_t estimated_vertices() const { return estimated_vertices_.load(std::memory_order_relaxed); }
  void AddSimplices(uint64_t count) { simplices_.fetch_add(count, std::memory_order_relaxed); }
  // `done` in [0, 1] of the current phase.
  void SetPhaseFraction(double done);

  // Wall-clock time spent in `phase` so far.
  absl::Duration TimeIn(Phase phase) const;

 private:
  enum class State : int { kRunning, kCancelled, kDeadlineExceeded };

  MemoryLender* lender_ = nullptr;
  std::atomic<State> state_{State::kRunning};
  std::atomic<Phase> phase_{Phase::kWaiting};
  std::atomic<uint64_t> vertices_{0};
  std::atomic<uint64_t> estimated_vertices_{0};
  std::atomic<uint64_t> simplices_{0};
  std::atomic<double> fraction_{0};
  std::array<std::atomic<int64_t>, kPhaseCount> entered_ns_{};
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_RUN_CONTEXT_H_
