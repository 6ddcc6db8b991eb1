// The policy of retries: the number of attempts at a call, and the times between them.
#ifndef WELLSPACE_CLIENT_RETRY_POLICY_H_
#define WELLSPACE_CLIENT_RETRY_POLICY_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace wellspace::client {

// The patience of a connection. An attempt that brought something (a chunk, an event, committed points) is not counted:
// later ones begin anew.
struct RetryPolicy {
  // Attempts in a row that may fail, with a server that has answered before; at least 1. So many take longer than the
  // 15 s after which another server takes over what one had that died.
  int max_attempts = 9;

  // As above, with a server that has never answered: its address may be wrong.
  int max_first_attempts = 3;

  // Waiting time before the second attempt; grows by `multiplier` for each further one, up to `max_backoff`. A random
  // half of it is left out, so that clients of a server that comes back do not come all at once. A delay that it
  // asks for (google.rpc.RetryInfo) is waited for in full.
  absl::Duration initial_backoff = absl::Milliseconds(200);
  double multiplier = 2;
  absl::Duration max_backoff = absl::Seconds(10);
};

// Whether the same call may succeed later: UNAVAILABLE, a reader that stalled, and errors with google.rpc.RetryInfo.
bool IsWorthRepeating(const absl::Status& status);

// An attempt at a call that has failed, and how the call stands.
struct FailedAttempt {
  absl::Status status;  // not OK

  // Attempts in a row that have failed, with this one; at least 1.
  int failures = 1;

  // Any call of the connection was ever answered.
  bool is_server_known = false;

  // The call knows that another attempt may help, whatever the status says.
  bool is_worth_repeating = false;

  // Until the deadline of the call.
  absl::Duration time_left = absl::InfiniteDuration();
};

// The time to wait before the next attempt; absent: there is to be none, since it makes no sense, there were enough, or
// the deadline comes before it. `jitter` is the part of the growing time that is waited for, in [0.5, 1].
//
// Guarantees: (1) a function of its arguments alone; (2) never less than the server asks for; (3) below time_left.
std::optional<absl::Duration> DelayBeforeRetry(const RetryPolicy& policy, const FailedAttempt& attempt, double jitter);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_RETRY_POLICY_H_
