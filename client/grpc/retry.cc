#include "client/grpc/retry.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/error_details.h"
#include "client/printable.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace wellspace::client {
namespace {

// The one error that comes without details: the server sends it ahead of a message that is not read, and can add none.
// Its message begins so.
constexpr char kReaderStalled[] = "READER_STALLED";
// What gRPC says, with the code UNKNOWN, of a stream that a proxy has broken off between two messages.
constexpr char kBrokenOff[] = "Stream removed";

// The key by which proxies send all calls on a session to one server.
constexpr char kSessionMetadata[] = "wellspace-session";

// Servers that send a client to and fro do not agree yet which of them has the session.
constexpr int kMostRedirects = 4;

absl::Status CancelledByCaller() { return absl::CancelledError("cancelled by the caller"); }

// Longer waits, which a server may ask for, would overflow the clock of the standard library.
constexpr absl::Duration kLongestWait = absl::Hours(24 * 365);

// False when a stop was asked for before the time had passed.
bool Wait(absl::Duration time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock<std::mutex> lock(mutex);
  never.wait_for(lock, stop, absl::ToChronoNanoseconds(std::min(time, kLongestWait)), [] { return false; });
  return !stop.stop_requested();
}

double RandomHalfToOne() {
  thread_local std::minstd_rand generator(std::random_device{}());
  return std::uniform_real_distribution<double>(0.5, 1)(generator);
}

}  // namespace

absl::Status FromGrpcStatus(const grpc::Status& status) {
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), Printable(status.error_message()));
  google::rpc::Status details;
  if (!result.ok() && details.ParseFromString(status.error_details())) {
    AddDetails(details, result);
  }
  if (status.error_details().empty() && status.error_message().starts_with(kReaderStalled)) {
    google::rpc::ErrorInfo info;
    info.set_reason("ERROR_REASON_READER_STALLED");
    details.add_details()->PackFrom(info);
    AddDetails(details, result);
  }
  if (absl::IsUnknown(result) && status.error_details().empty() && result.message() == kBrokenOff) {
    return absl::UnavailableError(absl::StrCat("the connection broke off: ", kBrokenOff));
  }
  return result;
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
  if (!attempt.session().empty()) {
    context_.AddMetadata(kSessionMetadata, attempt.session());
  }
}

absl::Status Retrier::Run(absl::Duration timeout, const std::stop_token& stop,
                          const std::function<absl::Status(Attempt&)>& attempt) {
  const absl::Duration deadline = SinceBoot() + timeout;
  int redirects = 0;  // in a row
  for (int failures = 0;;) {
    Attempt current(deadline - SinceBoot(), stop);
    absl::Status status = attempt(current);
    if (current.progressed() || status.code() != absl::StatusCode::kUnavailable || !ReasonOf(status).empty()) {
      reached_.store(true);
    }
    if (current.is_final() || status.ok()) {
      return status;
    }
    if (status.code() == absl::StatusCode::kCancelled && stop.stop_requested()) {
      return CancelledByCaller();
    }
    failures = current.progressed() ? 0 : failures;
    if (current.is_redirected() && redirects < kMostRedirects) {
      ++redirects;
      continue;
    }
    redirects = 0;
    ++failures;
    const std::optional<absl::Duration> delay = DelayBeforeRetry(policy_,
                                                                 {.status = status,
                                                                  .failures = failures,
                                                                  .is_server_known = reached_.load(),
                                                                  .is_worth_repeating = current.is_worth_repeating(),
                                                                  .time_left = deadline - SinceBoot()},
                                                                 RandomHalfToOne());
    if (!delay.has_value()) {
      return status;
    }
    if (!Wait(*delay, stop)) {
      return CancelledByCaller();
    }
  }
}

}  // namespace wellspace::client
