// The choice of the progress that is worth an event.
#ifndef WELLSPACE_SERVER_SESSIONS_PROGRESS_PACER_H_
#define WELLSPACE_SERVER_SESSIONS_PROGRESS_PACER_H_

#include <optional>

#include "absl/time/time.h"
#include "core/base/run_context.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// Turns the snapshots of one run into its progress events.
//
// Thread safety: thread-compatible.
// Invariants: (1) events are at least kMinInterval apart, the final one excepted; (2) asked at least every
// kMinInterval, it lets no more than kHeartbeat + kMinInterval pass without one; (3) phase, vertices, simplices and
// fraction never decrease; (4) sequence numbers count from that of the first.
class ProgressPacer {
 public:
  static constexpr absl::Duration kMinInterval = absl::Milliseconds(100);
  static constexpr absl::Duration kHeartbeat = absl::Seconds(1);

  explicit ProgressPacer(uint64_t first_sequence = 0) : next_sequence_(first_sequence) {}

  // The event to be sent at `now`, a time since boot, if one is due: something changed or the last one is old.
  std::optional<v1::ProgressEvent> Next(const core::Progress& progress, absl::Duration now);

  // The last event of a run that succeeded.
  v1::ProgressEvent Final(const core::Progress& progress);
  // The same of an event that Final of a copy of this has made before others came in between.
  v1::ProgressEvent Final(v1::ProgressEvent event);

 private:
  // The event for `progress`, never behind the one before.
  v1::ProgressEvent Advance(const core::Progress& progress);

  absl::Duration last_time_ = -absl::InfiniteDuration();
  uint64_t next_sequence_;
  core::Phase phase_ = core::Phase::kWaiting;
  v1::ProgressEvent last_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_PROGRESS_PACER_H_
