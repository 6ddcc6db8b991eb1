// The common options of all calls of the library.
#ifndef WELLSPACE_CLIENT_CALL_OPTIONS_H_
#define WELLSPACE_CLIENT_CALL_OPTIONS_H_

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/time/time.h"

namespace wellspace::client {

// The options of every call besides its arguments.
struct CallOptions {
  // Of the whole call, with all its attempts. Work that the call started goes on.
  absl::Duration timeout = absl::InfiniteDuration();

  // Ends the call with CANCELLED.
  std::stop_token stop;

  // Of a call that changes something: a repetition with the same id and content does nothing and returns the first
  // answer. Empty: one is chosen, so that calls repeated after a lost connection are done once.
  std::string request_id;

  // Of a call that changes a session: ABORTED unless the session is at this revision, of which 1 is the first.
  std::optional<uint64_t> expected_revision{};
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_CALL_OPTIONS_H_
