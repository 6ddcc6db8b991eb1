// Calls that end before their time: cancel, deadline, a stopping server, a reader that does not read.
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "gtest/gtest.h"
#include "tests/server/patience.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

// A cloud that makes some sixteen chunks.
void SendLargeCloud(TestCall& call) {
  call.Send(UnitCubeParameters());
  for (int i = 0; i < 10; ++i) {
    call.Send(RandomPoints(40'000));
  }
  call.HalfClose();
}

// The same, and reads up to the first chunk.
void ReadFirstChunk(TestCall& call) {
  SendLargeCloud(call);
  v1::MeshPointsResponse response;
  do {
    ASSERT_TRUE(call.Read(&response));
  } while (!response.has_chunk());
}

class Interrupted : public ::testing::TestWithParam<Transport> {};

INSTANTIATE_TEST_SUITE_P(Transports, Interrupted, ::testing::Values(Transport::kInProcess, Transport::kLoopback),
                         [](const auto& test) {
                           return test.param == Transport::kInProcess ? "InProcess" : "Loopback";
                         });

TEST_P(Interrupted, CancelFreesTheWorker) {
  Event started;
  ServiceHarness harness(EndlessMesher(started), {}, GetParam());
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  EXPECT_EQ(harness.Info().running_jobs(), 1);
  call.Cancel();
  EXPECT_LE(harness.TimeUntilIdle(), kIdleWithin);
  EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(harness.log().WaitFor("code=CANCELLED"));
}

TEST_P(Interrupted, CancelInEveryPhaseOfTheCoreFreesTheWorker) {
  ServiceHarness harness(core::MeshPoints, {}, GetParam());
  const std::vector<double> points = RandomPoints(20'000);
  for (const v1::Phase phase : {v1::PHASE_WAITING, v1::PHASE_TREE, v1::PHASE_REFINEMENT}) {
    TestCall call(harness.stub());
    call.Send(UnitCubeParameters());
    call.Send(points);
    call.HalfClose();
    v1::MeshPointsResponse response;
    do {
      ASSERT_TRUE(call.Read(&response));
      ASSERT_TRUE(response.has_progress());
    } while (PlaceOf(response.progress().phase()) < PlaceOf(phase));
    call.Cancel();
    EXPECT_LE(harness.TimeUntilIdle(), kIdleWithin) << v1::Phase_Name(phase);
    EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
}

TEST_P(Interrupted, CancelWhileWaitingLeavesTheQueue) {
  Event started;
  ServiceHarness harness(EndlessMesher(started), {}, GetParam());
  TestCall running(harness.stub());
  running.Send(UnitCubeParameters());
  running.HalfClose();
  ASSERT_TRUE(started.Wait());
  TestCall waiting(harness.stub());
  waiting.Send(UnitCubeParameters());
  waiting.HalfClose();
  while (harness.Info().queued_jobs() == 0) {
    std::this_thread::yield();
  }
  waiting.Cancel();
  EXPECT_EQ(waiting.Finish().error_code(), grpc::StatusCode::CANCELLED);
  ASSERT_TRUE(harness.log().WaitFor("code=CANCELLED"));
  EXPECT_EQ(harness.Info().queued_jobs(), 0);
  EXPECT_EQ(harness.Info().running_jobs(), 1);
}

TEST_P(Interrupted, CancelWhileSending) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.Send(RandomPoints(1000));
  v1::MeshPointsResponse response;
  ASSERT_TRUE(call.Read(&response));  // the server has the parameters
  call.Cancel();
  EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(harness.log().WaitFor("code=CANCELLED"));
  EXPECT_EQ(harness.Info().running_jobs(), 0);
}

TEST_P(Interrupted, CancelWhileReceivingTheMesh) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  TestCall call(harness.stub());
  ASSERT_NO_FATAL_FAILURE(ReadFirstChunk(call));
  call.Cancel();
  EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(harness.log().WaitFor("code=CANCELLED"));
}

TEST_P(Interrupted, DeadlineFreesTheWorker) {
  Event started;
  ServiceHarness harness(EndlessMesher(started), {}, GetParam());
  TestCall call(harness.stub(), absl::Milliseconds(300));
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_LE(harness.TimeUntilIdle(), kIdleWithin);
  // The client's reset may reach the server before the server's own clock says that it is late: code=CANCELLED then.
  EXPECT_TRUE(harness.log().WaitFor("method=MeshPoints"));
}

TEST_P(Interrupted, ServerStopsDuringTheWork) {
  Event started;
  ServiceHarness harness(EndlessMesher(started), {}, GetParam());
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  harness.server().Shutdown(absl::ZeroDuration());
  const grpc::Status status = call.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(DetailsOf(status).reason, "SERVER_STOPPING");
  EXPECT_TRUE(DetailsOf(status).may_retry);
}

TEST_P(Interrupted, ServerStopsDuringTheUpload) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.Send(RandomPoints(1000));
  v1::MeshPointsResponse response;
  ASSERT_TRUE(call.Read(&response));  // the server has the parameters
  std::thread stopper([&harness] { harness.server().Shutdown(absl::ZeroDuration()); });
  const grpc::Status status = call.Finish();
  stopper.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  if (GetParam() == Transport::kLoopback) {  // gRPC's in-process transport may close before the client has the details
    EXPECT_EQ(DetailsOf(status).reason, "SERVER_STOPPING") << status.error_message();
  }
}

TEST_P(Interrupted, ServerStopsUnderAReaderThatDoesNotRead) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  TestCall call(harness.stub());
  ASSERT_NO_FATAL_FAILURE(ReadFirstChunk(call));
  const absl::Time begin = absl::Now();
  harness.server().Shutdown(absl::ZeroDuration());
  EXPECT_LT(absl::Now() - begin, absl::Seconds(10));
  EXPECT_FALSE(call.Finish().ok());
}

TEST_P(Interrupted, RunningWorkGoesOnDuringTheGracePeriodAndNewCallsAreRefused) {
  Event started;
  Event go_on;
  ServiceHarness harness(
      [&](const core::MeshParameters& parameters, const core::Input& input, core::RunContext&) {
        started.Set();
        EXPECT_TRUE(go_on.Wait());
        return MakeFakeMesh(parameters, input.points);
      },
      {}, GetParam());
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  std::thread stopper([&harness] { harness.server().Shutdown(absl::Minutes(5)); });

  // Calls until the server refuses them; until then they wait behind the first.
  grpc::Status refused;
  while (refused.error_code() != grpc::StatusCode::UNAVAILABLE) {
    TestCall late(harness.stub(), absl::Milliseconds(50));
    refused = late.Finish();
  }
  EXPECT_EQ(DetailsOf(refused).reason, "SERVER_STOPPING");

  go_on.Set();
  const grpc::Status status = call.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(call.metadata.size(), 1u);
  stopper.join();
}

TEST_P(Interrupted, AReaderThatStopsReadingIsDropped) {
  ServiceOptions options;
  options.stall_limit = absl::Seconds(1);  // more than it takes to send the cloud, during which nothing is read
  ServiceHarness harness(FakeMesher, options, GetParam());
  TestCall call(harness.stub());
  ASSERT_NO_FATAL_FAILURE(ReadFirstChunk(call));
  ASSERT_TRUE(harness.log().WaitFor("code=DEADLINE_EXCEEDED"));
  const grpc::Status status = call.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_NE(status.error_message().find("READER_STALLED"), std::string::npos) << status.error_message();
}

TEST(SlowReader, IsNotDroppedAsLongAsItReads) {
  ServiceOptions options;
  options.stall_limit = absl::Seconds(1);
  ServiceHarness harness(FakeMesher, options, Transport::kLoopback);
  TestCall call(harness.stub());
  ASSERT_NO_FATAL_FAILURE(ReadFirstChunk(call));
  const absl::Time begin = absl::Now();
  v1::MeshPointsResponse response;
  while (call.Read(&response)) {
    if (absl::Now() - begin <= options.stall_limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));  // this makes it slow
    }
  }
  EXPECT_GT(absl::Now() - begin, options.stall_limit);
  const grpc::Status status = call.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(call.chunks.size(), call.metadata.at(0).chunk_count());
}

TEST(SlowReader, CostsABoundedBufferAndHoldsUpNoOther) {
  ServiceHarness harness;
  TestCall slow(harness.stub());
  ASSERT_NO_FATAL_FAILURE(ReadFirstChunk(slow));
  ASSERT_TRUE(harness.log().WaitFor("call=1 chunk=1"));

  // Were more of the slow one's chunks to be made, they would be while all of the other's are. The other begins only
  // now: calls are numbered in the order in which the server sees them.
  TestCall other(harness.stub());
  SendLargeCloud(other);
  ASSERT_TRUE(other.Finish().ok());
  EXPECT_GE(other.chunks.size(), 16u);
  // One was read, one is being written, and the in-process transport may hold one more.
  EXPECT_LE(harness.log().Count("call=1 chunk="), 3u);

  ASSERT_TRUE(slow.Finish().ok());
  EXPECT_EQ(slow.chunks.size(), slow.metadata.at(0).chunk_count());
  EXPECT_EQ(slow.chunks.size(), other.chunks.size());
  EXPECT_EQ(harness.log().Count("call=1 chunk="), slow.chunks.size());
}

TEST(ManyCalls, StartedAndCancelledAtRandomLeaveNothingBehind) {
  ServiceOptions options;
  options.workers = 2;
  options.max_queued_jobs = 4;
  ServiceHarness harness(FakeMesher, options, Transport::kLoopback);
  std::vector<std::thread> clients;
  for (unsigned seed = 0; seed < 4; ++seed) {
    clients.emplace_back([&harness, seed] {
      std::mt19937 generator(seed);
      for (int i = 0; i < 50; ++i) {
        TestCall call(harness.stub());
        const unsigned fate = generator() % 4;
        call.Send(UnitCubeParameters());
        if (fate == 0) {
          continue;  // the destructor cancels
        }
        call.Send(RandomPoints(1 + generator() % 3000));
        call.HalfClose();
        if (fate == 1) {
          call.Cancel();
        }
        const grpc::Status status = call.Finish();
        EXPECT_TRUE(status.ok() || status.error_code() == grpc::StatusCode::CANCELLED ||
                    status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED)
            << status.error_message();
      }
    });
  }
  for (std::thread& client : clients) {
    client.join();
  }
  harness.TimeUntilIdle();
  EXPECT_EQ(harness.Info().running_jobs() + harness.Info().queued_jobs(), 0);
}

}  // namespace
}  // namespace wellspace::server
