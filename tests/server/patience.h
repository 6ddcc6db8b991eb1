// How long a test grants what must be quick.
#ifndef WELLSPACE_TESTS_SERVER_PATIENCE_H_
#define WELLSPACE_TESTS_SERVER_PATIENCE_H_

#include "absl/time/time.h"

namespace wellspace::server {

// From a cancel to idle workers. Sanitizers slow programs down tenfold.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr absl::Duration kIdleWithin = absl::Seconds(1);
#else
inline constexpr absl::Duration kIdleWithin = absl::Milliseconds(100);
#endif

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_PATIENCE_H_
