// The clocks of the server: the wall clock for people, and the time since boot for the work.
#ifndef WELLSPACE_SERVER_BASE_CLOCK_H_
#define WELLSPACE_SERVER_BASE_CLOCK_H_

#include <functional>

#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace wellspace::server {

// Time since the machine was started, sleep included: CLOCK_BOOTTIME. It neither jumps nor stops, whatever is done to
// the wall clock; it is no absl::Time, so that neither can come in the place of the other.
//
// Threads:    thread-safe.
absl::Duration SinceBoot();

// The two clocks of a server.
struct Clock {
  // For times that are only shown: it may jump, in either direction.
  std::function<absl::Time()> wall = absl::Now;
  // For durations: leases, pacing, answers that are kept for a while.
  std::function<absl::Duration()> since_boot = SinceBoot;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_CLOCK_H_
