#include "client/retry_policy.h"

#include <algorithm>
#include <cmath>

#include "client/error_details.h"

namespace wellspace::client {

bool IsWorthRepeating(const absl::Status& status) {
  return status.code() == absl::StatusCode::kUnavailable || RetryDelayOf(status).has_value() ||
         ReasonOf(status) == "ERROR_REASON_READER_STALLED";
}

std::optional<absl::Duration> DelayBeforeRetry(const RetryPolicy& policy, const FailedAttempt& attempt, double jitter) {
  if (!attempt.is_worth_repeating && !IsWorthRepeating(attempt.status)) {
    return std::nullopt;
  }
  if (attempt.failures >= (attempt.is_server_known ? policy.max_attempts : policy.max_first_attempts)) {
    return std::nullopt;
  }
  const double growth = std::pow(policy.multiplier, attempt.failures - 1);
  const absl::Duration backoff = std::min(policy.initial_backoff * growth, policy.max_backoff) * jitter;
  const absl::Duration delay = std::max(backoff, RetryDelayOf(attempt.status).value_or(absl::ZeroDuration()));
  if (delay >= attempt.time_left) {
    return std::nullopt;
  }
  return delay;
}

}  // namespace wellspace::client
