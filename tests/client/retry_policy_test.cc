// Which errors are repeated, how often, and after which delay.
#include "client/retry_policy.h"

#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "google/rpc/error_details.pb.h"
#include "gtest/gtest.h"

namespace wellspace::client {
namespace {

using ::testing::Optional;

constexpr RetryPolicy kPolicy = {.max_attempts = 8,
                                 .max_first_attempts = 3,
                                 .initial_backoff = absl::Seconds(1),
                                 .multiplier = 2,
                                 .max_backoff = absl::Seconds(10)};

template <typename Message>
absl::Status WithDetail(absl::Status status, const Message& detail) {
  status.SetPayload(absl::StrCat("type.googleapis.com/", detail.GetTypeName()), absl::Cord(detail.SerializeAsString()));
  return status;
}

absl::Status WithReason(const std::string& reason) {
  google::rpc::ErrorInfo detail;
  detail.set_reason(reason);
  return WithDetail(absl::FailedPreconditionError("no"), detail);
}

absl::Status WithRetryInfo(int seconds) {
  google::rpc::RetryInfo detail;
  detail.mutable_retry_delay()->set_seconds(seconds);
  return WithDetail(absl::ResourceExhaustedError("full"), detail);
}

// An attempt whose status is worth repeating, with a server that has answered before.
FailedAttempt Failed(int failures) {
  return {.status = absl::UnavailableError("gone"), .failures = failures, .is_server_known = true};
}

TEST(RetryPolicy, StatusesWorthRepeating) {
  EXPECT_TRUE(IsWorthRepeating(absl::UnavailableError("gone")));
  EXPECT_TRUE(IsWorthRepeating(WithRetryInfo(1)));
  EXPECT_TRUE(IsWorthRepeating(WithReason("ERROR_REASON_READER_STALLED")));
  EXPECT_FALSE(IsWorthRepeating(WithReason("ERROR_REASON_SESSION_BUSY")));
  EXPECT_FALSE(IsWorthRepeating(absl::ResourceExhaustedError("full")));
  EXPECT_FALSE(IsWorthRepeating(absl::DeadlineExceededError("late")));
  EXPECT_FALSE(IsWorthRepeating(absl::OkStatus()));
}

TEST(RetryPolicy, DelayGrowsByTheMultiplierUpToItsBound) {
  for (const auto& [failures, seconds] : {std::pair(1, 1), {2, 2}, {3, 4}, {4, 8}, {5, 10}, {7, 10}}) {
    EXPECT_THAT(DelayBeforeRetry(kPolicy, Failed(failures), 1), Optional(absl::Seconds(seconds))) << failures;
    EXPECT_THAT(DelayBeforeRetry(kPolicy, Failed(failures), 0.5), Optional(absl::Seconds(seconds) / 2)) << failures;
  }
}

TEST(RetryPolicy, AServerThatHasAnsweredIsTriedMoreOften) {
  FailedAttempt attempt = Failed(7);
  EXPECT_TRUE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());
  attempt.failures = 8;
  EXPECT_FALSE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());

  attempt.is_server_known = false;
  attempt.failures = 2;
  EXPECT_TRUE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());
  attempt.failures = 3;
  EXPECT_FALSE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());
}

TEST(RetryPolicy, OnlyWhatIsWorthItIsRepeated) {
  FailedAttempt attempt = Failed(1);
  attempt.status = WithReason("ERROR_REASON_SESSION_BUSY");
  EXPECT_FALSE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());
  attempt.is_worth_repeating = true;  // the call knows better
  EXPECT_TRUE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());
}

TEST(RetryPolicy, WhatTheServerAsksForIsWaitedForInFull) {
  FailedAttempt attempt = Failed(1);
  attempt.status = WithRetryInfo(30);
  EXPECT_THAT(DelayBeforeRetry(kPolicy, attempt, 0.5), Optional(absl::Seconds(30)));
  attempt.status = WithRetryInfo(0);
  EXPECT_THAT(DelayBeforeRetry(kPolicy, attempt, 0.5), Optional(absl::Seconds(0.5)));
}

TEST(RetryPolicy, ADelayThatReachesTheDeadlineIsNone) {
  FailedAttempt attempt = Failed(1);
  attempt.time_left = absl::Seconds(1);
  EXPECT_FALSE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());
  attempt.time_left = absl::Seconds(1) + absl::Nanoseconds(1);
  EXPECT_THAT(DelayBeforeRetry(kPolicy, attempt, 1), Optional(absl::Seconds(1)));
  attempt.time_left = -absl::Seconds(1);  // it has passed
  EXPECT_FALSE(DelayBeforeRetry(kPolicy, attempt, 1).has_value());
}

}  // namespace
}  // namespace wellspace::client
