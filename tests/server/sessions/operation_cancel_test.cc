// An operation that is cancelled when its work is being submitted, or begins: so it may be with those that an earlier
// process has left, which clients know before they have a job.
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "absl/time/clock.h"
#include "gtest/gtest.h"
#include "server/backend.h"
#include "server/network/connections.h"
#include "server/sessions/refinement.h"
#include "server/store/session_log.h"
#include "spdlog/logger.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

class OperationCancelTest : public ::testing::Test {
 protected:
  const CallEnvironment& environment() const { return backend_.environment(); }

  // An operation that waits, and has no job yet.
  std::shared_ptr<Operation> Start() {
    return session_
        ->StartOperation({.dimension = 2}, /*restart=*/false, 0,
                         [](const std::shared_ptr<Operation>& /*operation*/) { return absl::OkStatus(); })
        .value();
  }

  std::shared_ptr<Job> Submit(std::function<void(Job&)> work) {
    return environment().jobs.Submit({.tenant = "a", .work = std::move(work)}).value();
  }

  // The work of `job` for `operation`: it goes on until it is cancelled. False: it never hears of that.
  bool WorkUntilCancelled(Operation& operation, Job& job) {
    std::optional<SessionWork> work;
    if (operation.SetJob(job.shared_from_this())) {
      work = session_->BeginWork(operation);
    }
    if (!work.has_value()) {
      return true;
    }
    const absl::Time latest = absl::Now() + absl::Seconds(10);
    while (job.context().Check().ok() && absl::Now() < latest) {
      std::this_thread::yield();
    }
    const bool is_heard = !job.context().Check().ok();
    WorkResult result{.status = absl::CancelledError(""), .work = *std::move(work), .mesh = nullptr};
    EXPECT_TRUE(session_->EndWork(operation, result));
    return is_heard;
  }

  std::function<void()> at_look_;  // is called when the session looks at the clock next
  const ServiceOptions options_{.workers = 1};
  const std::shared_ptr<spdlog::logger> logger_ = std::make_shared<spdlog::logger>("none");
  Authenticator authenticator_;
  Connections connections_{{}, logger_};
  Observability observability_{{}, logger_, connections_, [](const grpc::ServerContextBase&) { return ""; }};
  Backend backend_{options_,           authenticator_, observability_, logger_,
                   MakeEphemeralLog(), FakeMesher,     FakeEstimator,  core::Mesher::Create};
  MemoryBudget memory_{0};
  const std::unique_ptr<SessionLog> log_ = MakeEphemeralLog();
  const Clock clock_{.wall = [this] {
    if (const std::function<void()> now = std::exchange(at_look_, nullptr)) {
      now();
    }
    return absl::Now();
  }};
  SessionRegistry sessions_{options_, memory_, clock_, *log_};
  const std::shared_ptr<Session> session_ =
      sessions_.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = absl::Hours(1)}).value();
};

TEST_F(OperationCancelTest, AJobThatComesMeanwhileLeavesTheQueue) {
  Event may_end;
  Submit([&](Job&) { EXPECT_TRUE(may_end.Wait()); });
  const std::shared_ptr<Operation> operation = Start();
  const std::shared_ptr<Job> job = Submit([](Job&) {});
  at_look_ = [&] { EXPECT_TRUE(operation->SetJob(job)); };
  EXPECT_TRUE(CancelOperation(environment(), *session_, *operation).ok());
  EXPECT_EQ(operation->Describe().state(), v1::Operation::STATE_CANCELLED);
  EXPECT_EQ(environment().jobs.GetLoad().queued, 0) << "it has a place that others could have";
  may_end.Set();
  EXPECT_TRUE(environment().jobs.WaitUntilIdle(absl::Minutes(1)));
}

TEST_F(OperationCancelTest, AJobThatComesAfterwardsLeavesTheQueue) {
  Event may_end;
  Submit([&](Job&) { EXPECT_TRUE(may_end.Wait()); });
  const std::shared_ptr<Operation> operation = Start();
  EXPECT_TRUE(CancelOperation(environment(), *session_, *operation).ok());
  ResumeRefinements(environment(), {{.session = session_, .operation = operation}});
  EXPECT_EQ(environment().jobs.GetLoad().queued, 0);
  may_end.Set();
  EXPECT_TRUE(environment().jobs.WaitUntilIdle(absl::Minutes(1)));
}

TEST_F(OperationCancelTest, AJobThatBeginsMeanwhileHearsOfIt) {
  constexpr int kRounds = 3000;  // the moment is short
  for (int round = 0; round < kRounds; ++round) {
    const std::shared_ptr<Operation> operation = Start();
    std::atomic<int> ready = 0;
    const auto meet = [&] {
      for (++ready; ready < 2;) {
        std::this_thread::yield();
      }
    };
    std::atomic<bool> is_heard = false;
    Submit([&](Job& job) {
      meet();
      is_heard = WorkUntilCancelled(*operation, job);
    });
    meet();
    EXPECT_TRUE(CancelOperation(environment(), *session_, *operation).ok());
    ASSERT_TRUE(environment().jobs.WaitUntilIdle(absl::Minutes(1)));
    ASSERT_TRUE(is_heard) << "in round " << round;
    EXPECT_EQ(operation->Describe().state(), v1::Operation::STATE_CANCELLED);
  }
}

}  // namespace
}  // namespace wellspace::server
