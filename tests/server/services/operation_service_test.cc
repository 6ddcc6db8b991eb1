// The calls of OperationService over a channel, and the effects of operations on their session.
#include <chrono>
#include <future>
#include <mutex>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "gtest/gtest.h"
#include "tests/server/patience.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

// A script of ScriptedMesher that can be changed.
class Script {
 public:
  PhaseScript Hook() {
    return [this](core::Phase phase, core::RunContext& context) {
      PhaseScript now;
      {
        std::lock_guard lock(mutex_);
        now = script_;
      }
      return now == nullptr ? context.Check() : now(phase, context);
    };
  }
  // From now on; null does nothing.
  void Set(PhaseScript script) {
    std::lock_guard lock(mutex_);
    script_ = std::move(script);
  }

 private:
  std::mutex mutex_;
  PhaseScript script_;
};

class OperationServiceTest : public ::testing::Test {
 protected:
  void ExpectError(grpc::StatusCode code, const std::string& reason, const std::string& field = "") {
    EXPECT_EQ(status_.error_code(), code) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).reason, reason) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).field, field) << status_.error_message();
  }

  // A session with three points.
  std::string MakeSession() {
    const std::string name = calls_.Create(2).name();
    calls_.Upload(name, 0, {0.25, 0.25, 0.75, 0.25, 0.5, 0.75});
    return name;
  }

  Script script_;
  ServiceHarness harness_{FakeMesher,
                          {.workers = 1, .max_queued_jobs = 2},
                          Transport::kInProcess,
                          FakeEstimator,
                          ScriptedMesher(script_.Hook())};
  SessionCalls calls_{harness_.channel()};
  grpc::Status status_;
};

TEST_F(OperationServiceTest, ARefinementMakesTheSessionReady) {
  const std::string name = MakeSession();
  const v1::Operation started = calls_.Start(name);
  EXPECT_EQ(started.name(), name + "/operations/1");
  EXPECT_TRUE(started.has_create_time());
  EXPECT_EQ(started.parameters().dimension(), 2);
  Watch watch(calls_.operations(), started.name());
  EXPECT_TRUE(watch.Finish().ok());
  ASSERT_TRUE(watch.operation.has_value());
  const v1::Operation& ended = *watch.operation;
  EXPECT_EQ(ended.state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(ended.progress().phase(), v1::PHASE_DONE);
  EXPECT_EQ(ended.progress().fraction(), 1);
  EXPECT_FALSE(ended.has_error());
  EXPECT_TRUE(ended.has_start_time());
  EXPECT_TRUE(ended.has_end_time());

  const v1::Session session = calls_.Get(name);
  EXPECT_EQ(session.state(), v1::Session::STATE_READY) << "as soon as the operation says so";
  EXPECT_EQ(session.revision(), ended.mesh_revision());
  EXPECT_EQ(session.revision(), 3u);
  EXPECT_EQ(session.vertex_count(), 7u);
  EXPECT_GT(session.simplex_count(), 0u);
  EXPECT_EQ(session.last_operation(), ended.name());

  calls_.Upload(name, 3, {0.5, 0.5});
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(calls_.Get(name).vertex_count(), 7u) << "the last mesh is there still";
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY);
  EXPECT_EQ(calls_.Get(name).vertex_count(), 8u);
}

TEST_F(OperationServiceTest, ParametersReplaceThoseOfTheSession) {
  const std::string name = MakeSession();
  v1::StartRefinementRequest request;
  request.set_name(name);
  *request.mutable_parameters() = UnitCubeParameters(2);
  request.mutable_parameters()->set_rho(1.75);
  Watch(calls_.operations(), calls_.Start(request).name()).Finish();
  EXPECT_EQ(calls_.Get(name).parameters().rho(), 1.75);
  request.mutable_parameters()->clear_domain();
  request.mutable_parameters()->set_rho(1.5);
  Watch(calls_.operations(), calls_.Start(request).name()).Finish();
  EXPECT_EQ(calls_.Get(name).parameters().rho(), 1.5);
  EXPECT_EQ(calls_.Get(name).parameters().domain().high(0), 1) << "the domain is that of the session";

  request.mutable_parameters()->set_dimension(3);
  calls_.Start(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.dimension");
  *request.mutable_parameters() = UnitCubeParameters(2);
  request.mutable_parameters()->mutable_domain()->set_high(1, 2);
  calls_.Start(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.domain");
  *request.mutable_parameters() = UnitCubeParameters(2);
  request.mutable_parameters()->set_rho(0.1);
  calls_.Start(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.rho");
  EXPECT_EQ(calls_.Get(name).parameters().rho(), 1.5);
}

TEST_F(OperationServiceTest, ASessionThatIsRefiningIsBusy) {
  const std::string name = MakeSession();
  Event begun;
  script_.Set(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); }));
  v1::StartRefinementRequest request;
  request.set_name(name);
  request.set_request_id("start");
  const v1::Operation started = calls_.Start(request);
  ASSERT_TRUE(begun.Wait());
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_REFINING);
  EXPECT_EQ(calls_.Start(request).name(), started.name()) << "repeated";
  calls_.Start(name, &status_);
  ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "SESSION_BUSY");
  calls_.Upload(name, 3, {0.5, 0.5}, &status_);
  ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "SESSION_BUSY");
  calls_.Cancel(started.name());
}

TEST_F(OperationServiceTest, AStartForAnotherRevisionIsRefused) {
  const std::string name = MakeSession();
  v1::StartRefinementRequest request;
  request.set_name(name);
  request.set_expected_revision(1);
  calls_.Start(request, &status_);
  ExpectError(grpc::StatusCode::ABORTED, "REVISION_MISMATCH");
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_OPEN);
}

TEST_F(OperationServiceTest, AFullQueueRefusesToStart) {
  Event begun;
  script_.Set(EndlessIn(core::Phase::kTree, [&] { begun.Set(); }));
  const std::string running = calls_.Start(MakeSession()).name();
  ASSERT_TRUE(begun.Wait());
  const std::string first = calls_.Start(MakeSession()).name();
  const std::string second = calls_.Start(MakeSession()).name();
  const std::string refused = MakeSession();
  calls_.Start(refused, &status_);
  ExpectError(grpc::StatusCode::RESOURCE_EXHAUSTED, "QUEUE_FULL");
  EXPECT_EQ(calls_.Get(refused).state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(calls_.Get(refused).last_operation(), "");
  for (const std::string& name : {second, first, running}) {
    calls_.Cancel(name);
  }
}

TEST_F(OperationServiceTest, CancelWhileWaitingEndsTheOperationAtOnce) {
  Event begun;
  script_.Set(EndlessIn(core::Phase::kTree, [&] { begun.Set(); }));
  const std::string running = calls_.Start(MakeSession()).name();
  ASSERT_TRUE(begun.Wait());
  const std::string name = MakeSession();
  const std::string waiting = calls_.Start(name).name();
  EXPECT_EQ(calls_.GetOperation(waiting).state(), v1::Operation::STATE_QUEUED);
  EXPECT_FALSE(calls_.GetOperation(waiting).has_start_time());
  Watch watch(calls_.operations(), waiting);
  EXPECT_EQ(calls_.Cancel(waiting).state(), v1::Operation::STATE_CANCELLED);
  EXPECT_EQ(harness_.Info().queued_jobs(), 0);
  EXPECT_TRUE(watch.Finish().ok());
  EXPECT_EQ(watch.operation->error().code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(calls_.Cancel(waiting).state(), v1::Operation::STATE_CANCELLED) << "once more is no error";
  calls_.Cancel(running);
}

// "A cancel that is ignored in some phase"; first and later refinements, and the session afterwards.
TEST_F(OperationServiceTest, CancelInEveryPhaseLeavesTheSessionOpenWithAllItsPoints) {
  for (const bool has_mesh : {false, true}) {
    for (const core::Phase phase : {core::Phase::kTree, core::Phase::kRefinement, core::Phase::kSimplices}) {
      SCOPED_TRACE(absl::StrCat(core::PhaseName(phase), has_mesh ? " again" : ""));
      script_.Set(nullptr);
      const std::string name = MakeSession();
      if (has_mesh) {
        calls_.Refine(name);
        calls_.Upload(name, 3, {0.5, 0.5});
      }
      const v1::Session before = calls_.Get(name);
      Event begun;
      script_.Set(EndlessIn(phase, [&] { begun.Set(); }));
      const std::string operation = calls_.Start(name).name();
      ASSERT_TRUE(begun.Wait());
      Watch watch(calls_.operations(), operation);
      const absl::Time cancelled = absl::Now();
      calls_.Cancel(operation);
      EXPECT_TRUE(watch.Finish().ok());
      EXPECT_LE(absl::Now() - cancelled, kIdleWithin);
      EXPECT_EQ(watch.operation->state(), v1::Operation::STATE_CANCELLED);
      EXPECT_EQ(watch.operation->error().code(), grpc::StatusCode::CANCELLED);
      const v1::Session after = calls_.Get(name);
      EXPECT_EQ(after.state(), v1::Session::STATE_OPEN);
      EXPECT_EQ(after.committed_points(), before.committed_points());
      EXPECT_EQ(after.revision(), before.revision());
      EXPECT_EQ(after.vertex_count(), before.vertex_count());

      script_.Set(nullptr);
      EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
      EXPECT_EQ(calls_.Get(name).vertex_count(), before.committed_points() + 4);
    }
  }
}

TEST_F(OperationServiceTest, ARefinementThatDoesNotSucceedLeavesAReadySessionReady) {
  const std::string name = MakeSession();
  calls_.Refine(name);
  script_.Set([](core::Phase, core::RunContext&) { return absl::ResourceExhaustedError("too large"); });
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_FAILED);
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY) << "its mesh is that of all its points";
  EXPECT_EQ(calls_.Get(name).vertex_count(), 7u) << "the last mesh is there still";

  script_.Set(nullptr);
  calls_.Refine(name);
  Event begun;
  script_.Set(EndlessIn(core::Phase::kTree, [&] { begun.Set(); }));
  const std::string running = calls_.Start(MakeSession()).name();
  ASSERT_TRUE(begun.Wait());
  calls_.Cancel(calls_.Start(name).name());
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY);
  calls_.Cancel(running);
}

TEST_F(OperationServiceTest, AFailedRefinementLeavesTheSessionOpenWithAllItsPoints) {
  const std::string name = MakeSession();
  for (const core::Phase failing : {core::Phase::kTree, core::Phase::kRefinement, core::Phase::kSimplices}) {
    script_.Set([failing](core::Phase phase, core::RunContext&) {
      return phase == failing ? absl::ResourceExhaustedError("the mesh would be too large") : absl::OkStatus();
    });
    const v1::Operation operation = calls_.Refine(name);
    EXPECT_EQ(operation.state(), v1::Operation::STATE_FAILED);
    EXPECT_EQ(operation.error().code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(operation.error().message(), "the mesh would be too large");
    const grpc::Status status(grpc::StatusCode::RESOURCE_EXHAUSTED, "", operation.error().SerializeAsString());
    EXPECT_EQ(DetailsOf(status).reason, "MESH_TOO_LARGE") << "with the details that MeshPoints would have";
    EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_OPEN);
    EXPECT_EQ(calls_.Get(name).committed_points(), 3u);
  }
  script_.Set(nullptr);
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
}

TEST_F(OperationServiceTest, AMesherThatThrewIsBuiltAnew) {
  const std::string name = MakeSession();
  calls_.Refine(name);
  calls_.Upload(name, 3, {0.5, 0.5});
  script_.Set([](core::Phase phase, core::RunContext&) -> absl::Status {
    if (phase == core::Phase::kRefinement) {
      throw std::bad_alloc();
    }
    return absl::OkStatus();
  });
  const v1::Operation failed = calls_.Refine(name);
  EXPECT_EQ(failed.state(), v1::Operation::STATE_FAILED);
  EXPECT_EQ(failed.error().code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(calls_.Get(name).vertex_count(), 7u) << "the last mesh is there still";
  script_.Set(nullptr);
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(calls_.Get(name).vertex_count(), 8u);
}

TEST_F(OperationServiceTest, DeletingASessionCancelsItsOperation) {
  const std::string name = MakeSession();
  Event begun;
  script_.Set(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); }));
  const std::string operation = calls_.Start(name).name();
  ASSERT_TRUE(begun.Wait());
  Watch watch(calls_.operations(), operation);
  ASSERT_TRUE(watch.Read());
  calls_.Delete(name);
  EXPECT_LE(harness_.TimeUntilIdle(), kIdleWithin);
  EXPECT_TRUE(watch.Finish().ok());
  EXPECT_EQ(watch.operation->state(), v1::Operation::STATE_CANCELLED);
  calls_.GetOperation(operation, &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
}

// "Progress that is missing or jumps": at most 10 a second, at least one every 2 seconds, numbered without a gap for
// one who reads, never going back, whatever the phases do.
TEST_F(OperationServiceTest, ProgressIsSteadyAndNeverGoesBack) {
  const std::string name = MakeSession();
  script_.Set([](core::Phase phase, core::RunContext& context) {
    // More progress than there may be events, then nothing to tell.
    const absl::Time begin = absl::Now();
    for (int i = 0; absl::Now() - begin < absl::Milliseconds(phase == core::Phase::kRefinement ? 2500 : 400); ++i) {
      if (phase != core::Phase::kRefinement) {
        context.SetVertices(i);
        context.SetPhaseFraction(i * 1e-6);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return context.Check();
  });
  Watch watch(calls_.operations(), calls_.Start(name).name());
  EXPECT_TRUE(watch.Finish().ok());
  ASSERT_GE(watch.events.size(), 4u);
  for (size_t i = 0; i < watch.events.size(); ++i) {
    EXPECT_EQ(watch.events[i].sequence(), i);
    if (i > 0) {
      const v1::ProgressEvent& before = watch.events[i - 1];
      EXPECT_GE(PlaceOf(watch.events[i].phase()), PlaceOf(before.phase()));
      EXPECT_GE(watch.events[i].vertices(), before.vertices());
      EXPECT_GE(watch.events[i].simplices(), before.simplices());
      EXPECT_GE(watch.events[i].fraction(), before.fraction());
      EXPECT_LE(watch.times[i] - watch.times[i - 1], absl::Seconds(2)) << "before event " << i;
    }
  }
  const absl::Duration seconds = watch.times.back() - watch.times.front();
  EXPECT_LE(static_cast<double>(watch.events.size()), absl::ToDoubleSeconds(seconds) * 10 + 3);
  EXPECT_EQ(watch.events.back().phase(), v1::PHASE_DONE);
}

// "Fixed timeouts that kill a call that is progressing": a deadline bounds its own call only.
TEST_F(OperationServiceTest, WorkOutlivesThoseWhoWatchIt) {
  const std::string name = MakeSession();
  Event may_end;
  Event begun;
  script_.Set([&](core::Phase phase, core::RunContext& context) {
    if (phase == core::Phase::kRefinement) {
      begun.Set();
      EXPECT_TRUE(may_end.Wait());
    }
    return context.Check();
  });
  const std::string operation = calls_.Start(name).name();
  ASSERT_TRUE(begun.Wait());
  Watch impatient(calls_.operations(), operation, std::nullopt, absl::Milliseconds(300));
  EXPECT_EQ(impatient.Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  {
    Watch gone(calls_.operations(), operation);
    EXPECT_TRUE(gone.Read());
    gone.Cancel();
    EXPECT_EQ(gone.Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_EQ(calls_.GetOperation(operation).state(), v1::Operation::STATE_RUNNING);
  may_end.Set();
  Watch patient(calls_.operations(), operation);
  EXPECT_TRUE(patient.Finish().ok());
  EXPECT_EQ(patient.operation->state(), v1::Operation::STATE_SUCCEEDED);
}

TEST_F(OperationServiceTest, AWatchCanBeJoinedLateAndAgain) {
  const std::string name = MakeSession();
  Event may_end;
  script_.Set([&](core::Phase phase, core::RunContext& context) {
    if (phase == core::Phase::kRefinement) {
      EXPECT_TRUE(may_end.Wait());
    }
    return context.Check();
  });
  const std::string operation = calls_.Start(name).name();
  uint64_t last = 0;
  {
    Watch first(calls_.operations(), operation);
    ASSERT_TRUE(first.Read());
    EXPECT_EQ(first.events[0].sequence(), 0u);
    ASSERT_TRUE(first.ReadUntil(v1::PHASE_REFINEMENT));
    last = first.events.back().sequence();
  }
  Watch late(calls_.operations(), operation);
  ASSERT_TRUE(late.ReadUntil(v1::PHASE_REFINEMENT));
  EXPECT_EQ(late.events[0].sequence(), 0u) << "what is kept comes again";
  Watch again(calls_.operations(), operation, last);
  ASSERT_TRUE(again.Read());
  EXPECT_EQ(again.events[0].sequence(), last + 1);
  may_end.Set();
  EXPECT_TRUE(late.Finish().ok());
  EXPECT_TRUE(again.Finish().ok());
  EXPECT_EQ(late.operation->SerializeAsString(), again.operation->SerializeAsString());

  Watch after(calls_.operations(), operation);
  EXPECT_TRUE(after.Finish().ok());
  ASSERT_FALSE(after.events.empty()) << "the last event at least";
  EXPECT_EQ(after.events.back().phase(), v1::PHASE_DONE);
  Watch caught_up(calls_.operations(), operation, after.events.back().sequence());
  EXPECT_TRUE(caught_up.Finish().ok());
  EXPECT_TRUE(caught_up.events.empty());
  EXPECT_EQ(caught_up.operation->state(), v1::Operation::STATE_SUCCEEDED);
}

TEST_F(OperationServiceTest, ListsTheOldestFirst) {
  const std::string name = MakeSession();
  for (int i = 0; i < 5; ++i) {
    calls_.Refine(name);
  }
  v1::ListOperationsRequest request;
  request.set_parent(name);
  request.set_page_size(2);
  std::vector<std::string> listed;
  do {
    const v1::ListOperationsResponse page = calls_.ListOperations(request);
    for (const v1::Operation& operation : page.operations()) {
      listed.push_back(operation.name());
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  ASSERT_EQ(listed.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(listed[i], absl::StrCat(name, "/operations/", i + 1));
  }
  request.set_page_token("x");
  calls_.ListOperations(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "page_token");
  request.set_parent("sessions");
  calls_.ListOperations(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "parent");
}

TEST_F(OperationServiceTest, NamesThatNameNothing) {
  const std::string name = MakeSession();
  for (const std::string& wrong : {std::string(), name, name + "/operations", name + "/operations/", name + "/x/1"}) {
    calls_.GetOperation(wrong, &status_);
    ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "name");
  }
  calls_.GetOperation(name + "/operations/1", &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "OPERATION_NOT_FOUND", "name");
  calls_.Cancel(name + "/operations/01", &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "OPERATION_NOT_FOUND", "name");
  Watch watch(calls_.operations(), name + "/operations/1");
  status_ = watch.Finish();
  ExpectError(grpc::StatusCode::NOT_FOUND, "OPERATION_NOT_FOUND", "name");
}

TEST_F(OperationServiceTest, AnOperationKeepsItsSession) {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(2);
  request.mutable_ttl()->set_seconds(1);
  const std::string name = calls_.Create(request).name();
  Event may_end;
  script_.Set([&](core::Phase, core::RunContext& context) {
    EXPECT_TRUE(may_end.Wait());
    return context.Check();
  });
  const std::string operation = calls_.Start(name).name();
  const absl::Time begin = absl::Now();
  Watch watch(calls_.operations(), operation);
  while (absl::Now() - begin < absl::Seconds(3)) {
    ASSERT_TRUE(watch.Read());  // a heartbeat
  }
  may_end.Set();
  EXPECT_TRUE(watch.Finish().ok());
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY);
}

TEST_F(OperationServiceTest, AStoppingServerEndsWatchesAndWork) {
  Event begun;
  script_.Set(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); }));
  const std::string operation = calls_.Start(MakeSession()).name();
  const std::string waiting = calls_.Start(MakeSession()).name();
  ASSERT_TRUE(begun.Wait());
  Watch watch(calls_.operations(), operation);
  Watch watch_waiting(calls_.operations(), waiting);
  ASSERT_TRUE(watch.Read());
  ASSERT_TRUE(watch_waiting.Read());
  harness_.server().Shutdown(absl::ZeroDuration());
  EXPECT_EQ(watch.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(watch_waiting.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

// "A detached refinement dies with SIGTERM, though running work gets to its end".
TEST_F(OperationServiceTest, UnwatchedWorkGetsToItsEndBeforeAServerStops) {
  Event begun;
  Event go_on;
  script_.Set([&](core::Phase phase, core::RunContext& context) {
    if (phase == core::Phase::kRefinement) {
      begun.Set();
      EXPECT_TRUE(go_on.Wait());
    }
    return context.Check();
  });
  const std::string running = calls_.Start(MakeSession()).name();
  const std::string waiting = calls_.Start(MakeSession()).name();
  ASSERT_TRUE(begun.Wait());
  std::future<void> stopped = std::async(std::launch::async, [this] { harness_.server().Shutdown(absl::Minutes(5)); });
  v1::GetSessionRequest request;
  request.set_name("sessions/none");
  grpc::Status refused;
  while (refused.error_code() != grpc::StatusCode::UNAVAILABLE) {  // no call is under way any more
    grpc::ClientContext context;
    v1::GetSessionResponse response;
    refused = calls_.sessions().GetSession(&context, request, &response);
  }
  EXPECT_EQ(stopped.wait_for(std::chrono::milliseconds(300)), std::future_status::timeout) << "it waits for the work";
  go_on.Set();
  stopped.get();
  for (const std::string& name : {running, waiting}) {
    EXPECT_EQ(harness_.log().Count(absl::StrCat("event=refinement operation=", name, " tenant=default code=OK")), 1u)
        << name;
  }
}

TEST_F(OperationServiceTest, UnwatchedWorkEndsWithTheGracePeriod) {
  Event begun;
  script_.Set(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); }));
  calls_.Start(MakeSession());
  ASSERT_TRUE(begun.Wait());
  const absl::Time begin = absl::Now();
  harness_.server().Shutdown(absl::Milliseconds(20));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(10));
}

}  // namespace
}  // namespace wellspace::server
