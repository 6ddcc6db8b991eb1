// Clients that stop in the middle of a stream: they are dropped, and no other client notices.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/patience.h"
#include "tests/server/raw_http2.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "wellspace/v1/meshing.grpc.pb.h"
#include "wellspace/v1/operations.pb.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

// The settings of a peer that takes no data, of any call.
std::string NoWindow() {
  return Frame{.type = Frame::kSettings, .payload = absl::StrCat(std::string("\0\4", 2), BigEndian(0))}.Serialize();
}

TEST(StalledClients, AWatcherThatDoesNotReadIsDroppedAndTheWorkGoesOn) {
  ServiceOptions options;
  options.stall_limit = absl::Milliseconds(200);
  Event may_end;
  const auto wait = [&may_end](core::Phase phase, core::RunContext& /*context*/) {
    if (phase == core::Phase::kRefinement) {
      EXPECT_TRUE(may_end.Wait());
    }
    return absl::OkStatus();
  };
  ServiceHarness harness(FakeMesher, options, Transport::kLoopback, FakeEstimator, ScriptedMesher(wait));
  SessionCalls calls(harness.channel());
  const std::string session = calls.Create().name();
  calls.Upload(session, 0, UniformPoints(10, 3, 1));
  const std::string operation = calls.Start(session).name();
  Watch reader(calls.operations(), operation);
  ASSERT_TRUE(reader.Read());

  RawConnection stalled(harness.server().address());
  v1::WatchOperationRequest request;
  request.set_name(operation);
  stalled.Send(ConnectionStart() + NoWindow());
  stalled.Send(BeginCall(1, "/wellspace.v1.OperationService/WatchOperation"));
  stalled.Send(Frame{.type = Frame::kData,
                     .flags = Frame::kEndStream,
                     .stream = 1,
                     .payload = GrpcMessage(request.SerializeAsString())});
  EXPECT_EQ(stalled.ReadStatus(1), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(harness.log().WaitFor("method=WatchOperation code=DEADLINE_EXCEEDED"));

  may_end.Set();
  const grpc::Status status = reader.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  ASSERT_TRUE(reader.operation.has_value());
  EXPECT_EQ(reader.operation->state(), v1::Operation::STATE_SUCCEEDED);
}

const absl::Duration kUploadStallLimit = absl::Milliseconds(200 * kSlowdown);

class StalledUploads : public ::testing::TestWithParam<Transport> {
 protected:
  static ServiceOptions Options() {
    ServiceOptions options;
    options.upload_stall_limit = kUploadStallLimit;
    return options;
  }

  ServiceHarness harness_{FakeMesher, Options(), GetParam()};
};

INSTANTIATE_TEST_SUITE_P(Transports, StalledUploads, ::testing::Values(Transport::kInProcess, Transport::kLoopback),
                         [](const auto& transport) {
                           return transport.param == Transport::kInProcess ? "InProcess" : "Loopback";
                         });

void ExpectSenderStalled(const grpc::Status& status) {
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(DetailsOf(status).reason, "SENDER_STALLED");
  EXPECT_THAT(status.error_message(), HasSubstr(absl::FormatDuration(kUploadStallLimit)));
}

TEST_P(StalledUploads, OfMeshPointsAreDropped) {
  TestCall silent(harness_.stub());
  ExpectSenderStalled(silent.Finish());
  TestCall stopped(harness_.stub());
  stopped.Send(UnitCubeParameters());
  ExpectSenderStalled(stopped.Finish());
}

TEST_P(StalledUploads, OfEstimateMeshAreDropped) {
  grpc::ClientContext context;
  v1::EstimateMeshResponse response;
  const auto stream = harness_.stub().EstimateMesh(&context, &response);
  v1::EstimateMeshRequest request;
  *request.mutable_parameters() = UnitCubeParameters();
  stream->Write(request);
  ExpectSenderStalled(stream->Finish());
}

TEST_P(StalledUploads, OfASessionAreDroppedAndKeepWhatCame) {
  SessionCalls calls(harness_.channel());
  const std::string session = calls.Create().name();
  grpc::ClientContext context;
  v1::UploadPointsResponse response;
  const auto stream = calls.sessions().UploadPoints(&context, &response);
  stream->Write(UploadRequest(session, 0, UniformPoints(10, 3, 1)));
  ExpectSenderStalled(stream->Finish());
  EXPECT_EQ(calls.Get(session).committed_points(), 10u);
}

TEST_P(StalledUploads, AreNoneAsLongAsSomethingComes) {
  const absl::Time end = absl::Now() + 3 * Options().upload_stall_limit;
  TestCall call(harness_.stub());
  call.Send(UnitCubeParameters());
  while (absl::Now() < end && call.Send({0.5, 0.5, 0.5})) {
  }
  call.HalfClose();
  const grpc::Status status = call.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_P(StalledUploads, WorkMayTakeLonger) {
  Event started;
  Event may_end;
  ServiceHarness harness(
      [&](const core::MeshParameters& parameters, const core::Input& input, core::RunContext&) {
        started.Set();
        EXPECT_TRUE(may_end.Wait());
        return MakeFakeMesh(parameters, input.points);
      },
      Options(), GetParam());
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  // One that begins when the work is under way is dropped before it ends.
  TestCall silent(harness.stub());
  ExpectSenderStalled(silent.Finish());
  may_end.Set();
  EXPECT_TRUE(call.Finish().ok());
}

}  // namespace
}  // namespace wellspace::server
