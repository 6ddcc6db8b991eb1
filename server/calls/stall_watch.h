// Notices when a client takes too long over something.
#ifndef WELLSPACE_SERVER_CALLS_STALL_WATCH_H_
#define WELLSPACE_SERVER_CALLS_STALL_WATCH_H_

#include <chrono>
#include <functional>
#include <utility>

#include "absl/time/time.h"
#include "server/jobs/background.h"

namespace wellspace::server {

// Watches one thing after the other, with one task of the background thread under way at most.
//
// Thread safety: thread-compatible.
class StallWatch {
 public:
  // `limit` is how long one thing may take.
  StallWatch(Background& background, absl::Duration limit) : background_(background), limit_(limit) {}

  absl::Duration limit() const { return limit_; }

  // The next thing begins. `check` is called when it may have taken too long, and is to ask IsStalled.
  void Begin(std::function<void()> check) {
    is_waiting_ = true;
    start_ = Clock::now();
    if (!is_scheduled_) {
      Schedule(std::move(check));
    }
  }

  // It is done.
  void End() { is_waiting_ = false; }

  // For `check` to ask, with itself: whether the awaited event takes too long. If not, it will be called again.
  bool IsStalled(std::function<void()> check) {
    is_scheduled_ = false;
    if (!is_waiting_) {
      return false;
    }
    const bool is_stalled = Waited() >= limit_;
    if (!is_stalled) {
      Schedule(std::move(check));
    }
    return is_stalled;
  }

 private:
  using Clock = std::chrono::steady_clock;

  absl::Duration Waited() const { return absl::FromChrono(Clock::now() - start_); }

  void Schedule(std::function<void()> check) {
    is_scheduled_ = true;
    background_.PostAfter(limit_ - Waited(), std::move(check));
  }

  Background& background_;
  const absl::Duration limit_;
  bool is_waiting_ = false;
  Clock::time_point start_;
  bool is_scheduled_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_STALL_WATCH_H_
