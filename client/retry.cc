#include "client/retry.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <random>
#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/time/clock.h"
#include "client/error_details.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace wellspace::client {
namespace {

absl::Status CancelledByCaller() { return absl::CancelledError("cancelled by the caller"); }

// False when a stop was asked for before the time had passed.
bool Wait(absl::Duration time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock<std::mutex> lock(mutex);
  never.wait_for(lock, stop, absl::ToChronoNanoseconds(time), [] { return false; });
  return !stop.stop_requested();
}

double RandomHalfToOne() {
  thread_local std::minstd_rand generator(std::random_device{}());
  return std::uniform_real_distribution<double>(0.5, 1)(generator);
}

absl::Duration Backoff(const RetryPolicy& policy, int failures) {
  const double growth = std::pow(policy.multiplier, failures - 1);
  return std::min(policy.initial_backoff * growth, policy.max_backoff) * RandomHalfToOne();
}

}  // namespace

absl::Status FromGrpcStatus(const grpc::Status& status) {
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  google::rpc::Status details;
  if (!result.ok() && details.ParseFromString(status.error_details())) {
    AddDetails(details, result);
  }
  return result;
}

bool IsWorthRepeating(const absl::Status& status) {
  return status.code() == absl::StatusCode::kUnavailable || RetryDelayOf(status).has_value() ||
         ReasonOf(status) == "ERROR_REASON_READER_STALLED";
}

absl::Duration SinceBoot() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return absl::DurationFromTimespec(now);
}

CallContext::CallContext(const Attempt& attempt) : cancel_(attempt.stop(), [this] { context_.TryCancel(); }) {
  if (attempt.time_left() < absl::InfiniteDuration()) {
    // gRPC goes by its own clock from here on, which does not jump either.
    context_.set_deadline(absl::ToChronoTime(absl::Now() + attempt.time_left()));
  }
}

absl::Status Retrier::Run(absl::Duration timeout, const std::stop_token& stop,
                          const std::function<absl::Status(Attempt&)>& attempt) {
  const absl::Duration deadline = SinceBoot() + timeout;
  for (int failures = 0;;) {
    Attempt current(deadline - SinceBoot(), stop);
    absl::Status status = attempt(current);
    if (current.progressed() || status.code() != absl::StatusCode::kUnavailable) {
      reached_.store(true);
    }
    if (current.is_final() || status.ok()) {
      return status;
    }
    if (status.code() == absl::StatusCode::kCancelled && stop.stop_requested()) {
      return CancelledByCaller();
    }
    failures = current.progressed() ? 1 : failures + 1;
    if (!(IsWorthRepeating(status) || current.is_worth_repeating()) ||
        failures >= (reached_.load() ? policy_.max_attempts : policy_.max_first_attempts)) {
      return status;
    }
    const absl::Duration delay =
        std::max(Backoff(policy_, failures), RetryDelayOf(status).value_or(absl::ZeroDuration()));
    if (SinceBoot() + delay >= deadline) {
      return status;
    }
    if (!Wait(delay, stop)) {
      return CancelledByCaller();
    }
  }
}

}  // namespace wellspace::client
