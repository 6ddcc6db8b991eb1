// Calls that are made again, as a RetryPolicy says.
#ifndef WELLSPACE_CLIENT_GRPC_RETRY_H_
#define WELLSPACE_CLIENT_GRPC_RETRY_H_

#include <atomic>
#include <functional>
#include <stop_token>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client/retry_policy.h"
#include "grpcpp/client_context.h"
#include "grpcpp/support/status.h"

namespace wellspace::client {

// The status of a call as the library returns it: code, message without control characters, and the google.rpc details
// as payloads under their type URLs. A connection that broke is UNAVAILABLE, however gRPC has noticed it.
absl::Status FromGrpcStatus(const grpc::Status& status);

// A clock for timeouts: it does not jump when that on the wall is set. Zero when the machine was started, sleep
// included.
absl::Duration SinceBoot();

// One attempt at a call.
//
// Thread safety: thread-compatible.
class Attempt {
 public:
  // `time_left` until the deadline, from now on.
  Attempt(absl::Duration time_left, std::stop_token stop) : time_left_(time_left), stop_(std::move(stop)) {}

  absl::Duration time_left() const { return time_left_; }
  const std::stop_token& stop() const { return stop_; }

  // The id of the session that the call is about, for proxies; empty: none.
  void SetSession(std::string id) { session_ = std::move(id); }
  const std::string& session() const { return session_; }

  // The server has answered with something that the call keeps.
  void NoteProgress() { progressed_ = true; }
  bool progressed() const { return progressed_; }

  // `status` is the call's, whatever it is. Returns it.
  absl::Status Final(absl::Status status) {
    is_final_ = true;
    return status;
  }
  bool is_final() const { return is_final_; }

  // The next attempt is made at another server, which has what this one has not: at once.
  void SetRedirected() { is_redirected_ = true; }
  bool is_redirected() const { return is_redirected_; }

  // The status of this attempt is worth another, though IsWorthRepeating does not say so.
  void SetWorthRepeating() { is_worth_repeating_ = true; }
  bool is_worth_repeating() const { return is_worth_repeating_; }

 private:
  const absl::Duration time_left_;
  const std::stop_token stop_;
  std::string session_;
  bool progressed_ = false;
  bool is_final_ = false;
  bool is_redirected_ = false;
  bool is_worth_repeating_ = false;
};

// The context of one call of an attempt, with its deadline and, in the metadata, its session; cancelled when a stop is
// asked for.
class CallContext {
 public:
  explicit CallContext(const Attempt& attempt);

  grpc::ClientContext* get() { return &context_; }
  void Cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  std::stop_callback<std::function<void()>> cancel_;
};

// Makes calls until they succeed or another attempt makes no sense.
//
// Thread safety: thread-safe.
class Retrier {
 public:
  explicit Retrier(const RetryPolicy& policy) : policy_(policy) {}

  // Calls `attempt` until one is final, succeeds or fails with an error that is not worth repeating; at most as often
  // as the policy says, and until `timeout` has passed. An attempt that was redirected is no failure, but of more than
  // four in a row.
  // Errors:     the last attempt's; CANCELLED "cancelled by the caller" when `stop` asked for it.
  absl::Status Run(absl::Duration timeout, const std::stop_token& stop,
                   const std::function<absl::Status(Attempt&)>& attempt);

 private:
  const RetryPolicy policy_;
  std::atomic<bool> reached_{false};  // whether an attempt has reached the server
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_RETRY_H_
