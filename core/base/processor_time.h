// The processor time of work, on whichever threads it is done.
#ifndef WELLSPACE_CORE_BASE_PROCESSOR_TIME_H_
#define WELLSPACE_CORE_BASE_PROCESSOR_TIME_H_

#include <time.h>

#include <cstdint>

#include "absl/time/time.h"

namespace wellspace::core {

// Nanoseconds that the calling thread has run on a processor.
//
// Complexity: O(1), a call of the system.
inline int64_t ThreadNanoseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

// Nanoseconds that other threads have run for the calling one: in the loops of the ThreadTeams that it had, and that
// are no more. As the clock of a thread it belongs to that thread, and only grows.
inline int64_t& HelpersNanoseconds() {
  static thread_local int64_t nanoseconds = 0;
  return nanoseconds;
}

// The processor time of all that the calling thread has done, with its helpers'. Work takes the difference of two.
inline absl::Duration ProcessorTime() { return absl::Nanoseconds(ThreadNanoseconds() + HelpersNanoseconds()); }

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_PROCESSOR_TIME_H_
