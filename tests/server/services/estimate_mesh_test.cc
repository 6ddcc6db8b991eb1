// EstimateMesh through the service's own code and gRPC: the part that it shares with MeshPoints, and its answer.
#include <cmath>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "server/wire/errors.h"
#include "tests/server/patience.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

// One call on the client's side.
class EstimateCall {
 public:
  explicit EstimateCall(v1::MeshingService::Stub& stub) : stream_(stub.EstimateMesh(&context_, &response)) {}

  bool Send(const v1::MeshParameters& parameters) {
    v1::EstimateMeshRequest request;
    *request.mutable_parameters() = parameters;
    return stream_->Write(request);
  }
  bool Send(const std::vector<double>& coordinates) {
    v1::EstimateMeshRequest request;
    request.mutable_points()->mutable_coordinates()->Assign(coordinates.begin(), coordinates.end());
    return stream_->Write(request);
  }
  void HalfClose() { stream_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  grpc::Status Finish() { return stream_->Finish(); }

  v1::EstimateMeshResponse response;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientWriter<v1::EstimateMeshRequest>> stream_;
};

// Sends the parameters, if any, and `points`; returns how the call ends.
grpc::Status Estimate(EstimateCall& call, const v1::MeshParameters& parameters, const std::vector<double>& points) {
  if (call.Send(parameters) && call.Send(points)) {
    call.HalfClose();
  }
  return call.Finish();
}

Estimator EndlessEstimator(Event& started) {
  return [mesher = EndlessMesher(started)](const core::MeshParameters& parameters, const core::Input& input,
                                           core::RunContext& context) -> absl::StatusOr<core::MeshEstimate> {
    return mesher(parameters, input, context).status();
  };
}

class EstimateMeshOver : public ::testing::TestWithParam<Transport> {};

INSTANTIATE_TEST_SUITE_P(Transports, EstimateMeshOver, ::testing::Values(Transport::kInProcess, Transport::kLoopback),
                         [](const auto& test) {
                           return test.param == Transport::kInProcess ? "InProcess" : "Loopback";
                         });

TEST_P(EstimateMeshOver, AnswersOnceWithTheFiguresOfTheEstimator) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  EstimateCall call(harness.stub());
  ASSERT_TRUE(call.Send(UnitCubeParameters()));
  ASSERT_TRUE(call.Send(std::vector<double>(3 * 7)));
  ASSERT_TRUE(call.Send(std::vector<double>(3 * 3)));
  call.HalfClose();
  const grpc::Status status = call.Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(call.response.vertices(), 10u);
  EXPECT_EQ(call.response.simplices(), 20u);
  EXPECT_EQ(call.response.memory_bytes(), 30u);
  EXPECT_EQ(call.response.tree_leaves(), 40u);
  EXPECT_TRUE(harness.log().WaitFor("method=EstimateMesh"));
  EXPECT_TRUE(harness.log().WaitFor("points=10 vertices=10"));
}

TEST_P(EstimateMeshOver, CancelFreesTheWorker) {
  Event started;
  ServiceHarness harness(FakeMesher, {}, GetParam(), EndlessEstimator(started));
  EstimateCall call(harness.stub());
  ASSERT_TRUE(call.Send(UnitCubeParameters()));
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  EXPECT_EQ(harness.Info().running_jobs(), 1);
  call.Cancel();
  EXPECT_LE(harness.TimeUntilIdle(), kIdleWithin);
  EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(harness.log().WaitFor("code=CANCELLED"));
}

TEST_P(EstimateMeshOver, AStoppingServerEndsTheCall) {
  Event started;
  ServiceHarness harness(FakeMesher, {}, GetParam(), EndlessEstimator(started));
  EstimateCall call(harness.stub());
  ASSERT_TRUE(call.Send(UnitCubeParameters()));
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  harness.server().Shutdown(absl::ZeroDuration());
  const grpc::Status status = call.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
  EXPECT_EQ(DetailsOf(status).reason, "SERVER_STOPPING");
}

// The requests are judged by the same code as those of MeshPoints; each kind of refusal shows that it is asked.
TEST(EstimateMeshFails, AsMeshPointsDoes) {
  ServiceOptions options;
  options.max_points = 3;
  ServiceHarness harness(FakeMesher, options, Transport::kInProcess,
                         [](const auto&, auto, auto&) -> absl::StatusOr<core::MeshEstimate> {
                           return absl::InvalidArgumentError("points[0]: coordinate 0 is nan");
                         });
  const auto reason = [&harness](const v1::MeshParameters& parameters, const std::vector<double>& points) {
    EstimateCall call(harness.stub());
    return DetailsOf(Estimate(call, parameters, points)).reason;
  };
  EXPECT_EQ(reason(UnitCubeParameters(7), {}), "INVALID_PARAMETERS");
  EXPECT_EQ(reason(UnitCubeParameters(), {1, 2}), "INVALID_CHUNK_SHAPE");
  EXPECT_EQ(reason(UnitCubeParameters(), std::vector<double>(12)), "TOO_MANY_POINTS");
  EXPECT_EQ(reason(UnitCubeParameters(), {1, 2, 3}), "INVALID_POINTS");
  EstimateCall without_parameters(harness.stub());
  without_parameters.HalfClose();
  EXPECT_EQ(DetailsOf(without_parameters.Finish()).reason, "PARAMETERS_MISSING");
}

TEST(EstimateMeshFails, WithoutMemoryOrByABug) {
  const auto reason = [](const Estimator& estimator) {
    ServiceHarness harness(FakeMesher, {}, Transport::kInProcess, estimator);
    EstimateCall call(harness.stub());
    return DetailsOf(Estimate(call, UnitCubeParameters(), {})).reason;
  };
  EXPECT_EQ(reason([](const auto&, auto, auto&) -> absl::StatusOr<core::MeshEstimate> { throw std::bad_alloc(); }),
            "OUT_OF_MEMORY");
  EXPECT_EQ(reason([](const auto&, auto, auto&) -> absl::StatusOr<core::MeshEstimate> {
              return absl::UnknownError("a bug");
            }),
            "INTERNAL");
}

// A job like any other: the queue is one.
TEST(EstimateMeshFails, WhenTheQueueIsFull) {
  Event started;
  ServiceOptions options;
  options.max_queued_jobs = 0;
  ServiceHarness harness(EndlessMesher(started), options);
  TestCall meshing(harness.stub());
  meshing.Send(UnitCubeParameters());
  meshing.HalfClose();
  ASSERT_TRUE(started.Wait());
  EstimateCall call(harness.stub());
  const grpc::Status status = Estimate(call, UnitCubeParameters(), {});
  EXPECT_EQ(DetailsOf(status).reason, "QUEUE_FULL");
  EXPECT_TRUE(DetailsOf(status).may_retry);
}

TEST(EstimateMeshOfTheCore, IsNearTheMesh) {
  ServiceHarness harness(core::MeshPoints, {}, Transport::kInProcess, core::EstimateMesh);
  std::vector<double> points;
  for (int i = 0; i < 500; ++i) {  // a Weyl sequence
    points.push_back(std::fmod(i * 0.7548776662466927, 1));
    points.push_back(std::fmod(i * 0.5698402909980532, 1));
  }
  const v1::MeshParameters parameters = UnitCubeParameters(2);
  EstimateCall estimate(harness.stub());
  const grpc::Status status = Estimate(estimate, parameters, points);
  ASSERT_TRUE(status.ok()) << status.error_message();
  TestCall mesh(harness.stub());
  ASSERT_TRUE(mesh.Send(parameters) && mesh.Send(points));
  mesh.HalfClose();
  ASSERT_TRUE(mesh.Finish().ok());
  const auto vertices = static_cast<double>(mesh.metadata.at(0).vertex_count());
  EXPECT_GT(static_cast<double>(estimate.response.vertices()), vertices / 4);
  EXPECT_LT(static_cast<double>(estimate.response.vertices()), vertices * 4);
  EXPECT_GT(estimate.response.simplices(), estimate.response.vertices());
  EXPECT_GT(estimate.response.memory_bytes(), estimate.response.vertices());
  EXPECT_GT(estimate.response.tree_leaves(), 0u);
}

}  // namespace
}  // namespace wellspace::server
