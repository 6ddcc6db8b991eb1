// The time that a test grants to steps that must be quick.
#ifndef WELLSPACE_TESTS_SERVER_PATIENCE_H_
#define WELLSPACE_TESTS_SERVER_PATIENCE_H_

#include "absl/time/time.h"

namespace wellspace::server {

// Sanitizers slow programs down tenfold.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr int kSlowdown = 10;
#else
inline constexpr int kSlowdown = 1;
#endif

// From a cancel to idle workers.
inline constexpr absl::Duration kIdleWithin = absl::Milliseconds(100 * kSlowdown);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_PATIENCE_H_
