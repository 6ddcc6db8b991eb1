// Admission under a limit of memory: jobs are taken, refused or wait; "refinement that eats the memory, and takes every
// other user's work with it" cannot happen.
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include "server/security/tokens.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kMegabyte = uint64_t{1} << 20;
constexpr size_t kPiece = 40'000;  // points of a message

// 64 MB for work.
ServiceOptions LittleMemory(int workers = 2) {
  ServiceOptions options;
  options.workers = workers;
  options.max_memory_bytes = kMinMemoryBytes;
  return options;
}

// Reserves a megabyte for each of its points, and gives a mesh when `go` is set.
Mesher MesherOfMegabytes(Event& reserved, Event& go) {
  return [&](const core::MeshParameters& parameters, const core::Input& input,
             core::RunContext& context) -> absl::StatusOr<core::Mesh> {
    if (absl::Status status = context.ReserveMemory(input.points.size() / parameters.dimension * kMegabyte);
        !status.ok()) {
      return status;
    }
    reserved.Set();
    EXPECT_TRUE(go.Wait());
    return MakeFakeMesh(parameters, input.points);
  };
}

// Sends `points` points at the centre of the cube.
void SendPoints(TestCall& call, size_t points) {
  call.Send(UnitCubeParameters());
  call.Send(std::vector<double>(3 * points, 0.5));
  call.HalfClose();
}

void ExpectMemoryLimit(const grpc::Status& status, bool may_retry) {
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT") << status.error_message();
  EXPECT_EQ(DetailsOf(status).may_retry, may_retry) << status.error_message();
  EXPECT_NE(status.error_message().find("67.1 MB for all work"), std::string::npos) << status.error_message();
}

v1::GetServerInfoResponse InfoWithToken(ServiceHarness& harness, const std::string& token) {
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + token);
  v1::GetServerInfoResponse response;
  EXPECT_TRUE(harness.stub().GetServerInfo(&context, {}, &response).ok());
  return response;
}

// The status of a call that is made again while it is told to: a job's memory is free shortly after its call has
// ended.
grpc::Status SendUntilThereIsRoom(ServiceHarness& harness) {
  grpc::Status status;
  do {
    TestCall call(harness.stub());
    SendPoints(call, 1);
    status = call.Finish();
  } while (DetailsOf(status).reason == "MEMORY_LIMIT");
  return status;
}

TEST(Admission, AMeshThatNeverFitsIsRefusedBeforeRefinementWithFigures) {
  ServiceHarness harness(core::MeshPoints, LittleMemory());
  TestCall call(harness.stub());
  v1::MeshParameters parameters = UnitCubeParameters();
  parameters.set_max_circumradius(0.002);  // some 10^8 vertices
  call.Send(parameters);
  call.HalfClose();
  const grpc::Status status = call.Finish();
  ExpectMemoryLimit(status, /*may_retry=*/false);
  for (const v1::ProgressEvent& event : call.events) {
    EXPECT_LE(event.phase(), v1::PHASE_TREE);
  }
  const grpc::Status small = SendUntilThereIsRoom(harness);
  EXPECT_TRUE(small.ok()) << small.error_message();
}

TEST(Admission, ACloudThatDoesNotFitIsRefusedWhileItComes) {
  ServiceHarness harness(core::MeshPoints, LittleMemory());
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  const std::vector<double> piece(3 * kPiece, 0.5);
  for (int i = 0; i < 100 && call.Send(piece); ++i) {
  }
  ExpectMemoryLimit(call.Finish(), /*may_retry=*/false);
}

// A server of little memory, and a job that holds some of it until it is let go.
class AdmissionBesideAHolder : public ::testing::Test {
 protected:
  void Hold(size_t megabytes) {
    SendPoints(holder_, megabytes);
    ASSERT_TRUE(reserved_.Wait());
  }
  void LetGo() {
    go_.Set();
    EXPECT_TRUE(holder_.Finish().ok());
  }

  Event reserved_;
  Event go_;
  ServiceHarness harness_{MesherOfMegabytes(reserved_, go_), LittleMemory()};
  TestCall holder_{harness_.stub()};
};

TEST_F(AdmissionBesideAHolder, ACloudThatThereIsNoRoomForMayBeSentAgain) {
  Hold(60);
  TestCall refused(harness_.stub());
  SendPoints(refused, 1);
  ExpectMemoryLimit(refused.Finish(), /*may_retry=*/true);
  LetGo();
  const grpc::Status again = SendUntilThereIsRoom(harness_);
  EXPECT_TRUE(again.ok()) << again.error_message();
}

TEST(Admission, EstimatesReserveForTheirTree) {
  ServiceHarness harness(FakeMesher, LittleMemory(), Transport::kInProcess,
                         [](const core::MeshParameters&, const core::Input&, core::RunContext& context) {
                           return absl::StatusOr<core::MeshEstimate>(context.ReserveMemory(65 * kMegabyte));
                         });
  grpc::ClientContext context;
  v1::EstimateMeshResponse response;
  const auto writer = harness.stub().EstimateMesh(&context, &response);
  v1::EstimateMeshRequest request;
  *request.mutable_parameters() = UnitCubeParameters();
  writer->Write(request);
  writer->WritesDone();
  ExpectMemoryLimit(writer->Finish(), /*may_retry=*/false);
}

TEST(Admission, AJobThatOutgrowsItsReservationEndsAndOthersGoOn) {
  std::atomic<bool> outgrows = true;
  ServiceHarness harness(
      [&](const core::MeshParameters& parameters, const core::Input& input,
          core::RunContext& context) -> absl::StatusOr<core::Mesh> {
        EXPECT_TRUE(context.ReserveMemory(kMegabyte).ok());
        for (uint64_t bytes = kMegabyte; outgrows; bytes += kMegabyte) {
          if (absl::Status status = context.AllowMemory(bytes); !status.ok()) {
            EXPECT_GT(bytes, 32 * kMegabyte);  // it had all that there was
            return status;
          }
        }
        return MakeFakeMesh(parameters, input.points);
      },
      LittleMemory());
  TestCall call(harness.stub());
  SendPoints(call, 1);
  const grpc::Status status = call.Finish();
  EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT") << status.error_message();
  outgrows = false;
  const grpc::Status other = SendUntilThereIsRoom(harness);
  EXPECT_TRUE(other.ok()) << other.error_message();
}

TEST(Admission, SmallJobsOfATenantFinishWhileLargeOnesOfAnotherWait) {
  const std::string large_token(40, 'l');
  const std::string small_token(40, 's');
  TemporaryFolder folder;
  SecurityOptions security;
  security.token_file =
      folder.Write("tokens", *MakeTokenLine("large", large_token) + "\n" + *MakeTokenLine("small", small_token) + "\n");
  Event holds;
  Event go;
  const Mesher mesher = [&](const core::MeshParameters& parameters, const core::Input& input,
                            core::RunContext& context) -> absl::StatusOr<core::Mesh> {
    if (input.points.size() > 3) {  // a large one
      if (absl::Status status = context.ReserveMemory(40 * kMegabyte); !status.ok()) {
        return status;
      }
      holds.Set();
      EXPECT_TRUE(go.Wait());
      return MakeFakeMesh(parameters, input.points);
    }
    return core::MeshPoints(parameters, input, context);
  };
  ServiceHarness harness(mesher, LittleMemory(), Transport::kLoopback, FakeEstimator, core::Mesher::Create, security);
  TestCall first(harness.stub(), std::nullopt, large_token);
  SendPoints(first, 2);
  ASSERT_TRUE(holds.Wait());
  // One of them has a worker and gives it away, the others stay behind it.
  std::vector<std::unique_ptr<TestCall>> waiting;
  for (int i = 0; i < 5; ++i) {
    waiting.push_back(std::make_unique<TestCall>(harness.stub(), std::nullopt, large_token));
    SendPoints(*waiting.back(), 2);
    // Until its cloud is complete it has room for another message, which not all have at once.
    while (InfoWithToken(harness, large_token).queued_jobs() <= i) {
      std::this_thread::yield();
    }
  }
  for (int i = 0; i < FairQueue::kMaxSkips / 2; ++i) {
    TestCall small(harness.stub(), std::nullopt, small_token);
    SendPoints(small, 1);
    const grpc::Status status = small.Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  go.Set();
  EXPECT_TRUE(first.Finish().ok());
  for (const std::unique_ptr<TestCall>& call : waiting) {
    const grpc::Status status = call->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
}

TEST(Admission, ATenantHasItsShareOfTheJobs) {
  Event started;
  ServiceOptions options;
  options.max_jobs_per_tenant = 1;
  ServiceHarness harness(EndlessMesher(started), options);
  TestCall call(harness.stub());
  SendPoints(call, 1);
  ASSERT_TRUE(started.Wait());
  TestCall second(harness.stub());
  SendPoints(second, 1);
  const grpc::Status status = second.Finish();
  EXPECT_EQ(DetailsOf(status).reason, "QUOTA_EXCEEDED") << status.error_message();
  EXPECT_TRUE(DetailsOf(status).may_retry);
}

TEST_F(AdmissionBesideAHolder, CancelWhileWaitingForMemoryGivesAllBack) {
  Hold(40);
  TestCall waiting(harness_.stub());
  SendPoints(waiting, 40);
  while (harness_.Info().queued_jobs() == 0) {
    std::this_thread::yield();
  }
  waiting.Cancel();
  EXPECT_EQ(waiting.Finish().error_code(), grpc::StatusCode::CANCELLED);
  while (harness_.Info().queued_jobs() > 0) {
    std::this_thread::yield();
  }
  LetGo();
}

// Every kind of small work, where each worker and each place in the queue has a large mesh of another.
TEST(Admission, SmallWorkWaitsForNoLargeMesh) {
  Event begun;
  Event may_end;
  const auto mesher = [&](const core::MeshParameters& parameters, const core::Input& input, core::RunContext& context) {
    if (input.points.size() > 3 * 1000) {
      begun.Set();
      EXPECT_TRUE(may_end.Wait());
    }
    return core::MeshPoints(parameters, input, context);
  };
  ServiceHarness harness(mesher, {.workers = 1, .small_workers = 1, .max_queued_jobs = 1, .max_jobs_per_tenant = 2});
  const auto start = [&harness](size_t points) {
    auto call = std::make_unique<TestCall>(harness.stub());
    call->Send(UnitCubeParameters());
    call->Send(RandomPoints(points));
    call->HalfClose();
    return call;
  };
  const std::unique_ptr<TestCall> running = start(10'000);
  ASSERT_TRUE(begun.Wait());
  const std::unique_ptr<TestCall> waiting = start(10'000);
  while (harness.Info().queued_jobs() != 1) {
  }
  EXPECT_EQ(start(10'000)->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << "the queue is full";
  for (int i = 0; i < 20; ++i) {
    const grpc::Status status = start(300)->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    while (harness.Info().running_jobs() != 1) {  // its worker is free shortly after
    }
  }
  SessionClient session(harness.channel());
  session.Upload(UniformPoints(300, 3, 1));
  EXPECT_EQ(session.Refine().state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(harness.Info().queued_jobs(), 1) << "the large one has its place still";
  EXPECT_FALSE(may_end.IsSet());
  may_end.Set();
  EXPECT_TRUE(running->Finish().ok());
  EXPECT_TRUE(waiting->Finish().ok());
}

}  // namespace
}  // namespace wellspace::server
