// Numbers of every size in requests, over the service: refused or served, and the server stays.
#include <cmath>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "core/meshers/mesher.h"
#include "gtest/gtest.h"
#include "server/wire/errors.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

v1::MeshParameters InTheUnitBox(int dimension) {
  v1::MeshParameters parameters = UnitCubeParameters(dimension);
  parameters.set_min_dihedral(0);
  parameters.set_max_vertices((uint64_t{1} << dimension) + 20);
  return parameters;
}

grpc::Status EstimateOf(ServiceHarness& harness, const v1::MeshParameters& parameters,
                        v1::EstimateMeshResponse* response) {
  grpc::ClientContext context;
  const auto stream = harness.stub().EstimateMesh(&context, response);
  v1::EstimateMeshRequest request;
  *request.mutable_parameters() = parameters;
  stream->Write(request);
  stream->WritesDone();
  return stream->Finish();
}

grpc::Status MeshOf(ServiceHarness& harness, const v1::MeshParameters& parameters) {
  grpc::ClientContext context;
  const auto stream = harness.stub().MeshPoints(&context);
  v1::MeshPointsRequest request;
  *request.mutable_parameters() = parameters;
  stream->Write(request);
  stream->WritesDone();
  v1::MeshPointsResponse response;
  while (stream->Read(&response)) {
  }
  return stream->Finish();
}

class ExtremeRequests : public ::testing::TestWithParam<int> {
 protected:
  ServiceHarness harness_{core::MeshPoints, {}, Transport::kInProcess, core::EstimateMesh};
};

INSTANTIATE_TEST_SUITE_P(Dimensions, ExtremeRequests, ::testing::Range(2, 6));  // 6-D takes half a second each

TEST_P(ExtremeRequests, EndWithCountsOrARefusal) {
  const int dimension = GetParam();
  for (const v1::Criterion criterion : {v1::CRITERION_RADIUS_EDGE, v1::CRITERION_WELL_SPACED}) {
    for (int exponent = -1074 + dimension; exponent <= 1023; exponent += dimension < 4 ? 67 : 263) {
      const double x = std::ldexp(1.0, exponent);
      std::vector<v1::MeshParameters> requests(8, InTheUnitBox(dimension));
      requests[0].set_max_circumradius(x);
      requests[1].set_rho(x);
      for (int k = 2; k < 4; ++k) {
        v1::SizeBox* box = requests[k].add_size_boxes();
        box->mutable_low()->Resize(dimension, k == 2 ? 0.0 : -x);
        box->mutable_high()->Resize(dimension, k == 2 ? 0.0 : x);
        box->set_max_circumradius(k == 2 ? x : 1.0);
      }
      for (int k = 4; k < 6; ++k) {
        requests[k].mutable_domain()->mutable_high()->Clear();
        requests[k].mutable_domain()->mutable_high()->Resize(dimension, x);
        requests[k].set_max_circumradius(k == 4 ? 1 : 0);
      }
      requests[6].set_edge_length(x);
      requests[7] = requests[2];
      requests[7].mutable_size_boxes(0)->set_max_circumradius(0.5);
      requests[7].set_gradation(x);
      for (v1::MeshParameters& parameters : requests) {
        parameters.set_criterion(criterion);
        v1::EstimateMeshResponse estimate;
        if (const grpc::Status status = EstimateOf(harness_, parameters, &estimate); status.ok()) {
          EXPECT_GE(estimate.vertices(), uint64_t{1} << dimension) << parameters.ShortDebugString();
          EXPECT_GT(estimate.memory_bytes(), 0u) << parameters.ShortDebugString();
        } else {
          EXPECT_FALSE(DetailsOf(status).reason.empty()) << status.error_message();
        }
        if (const grpc::Status status = MeshOf(harness_, parameters); !status.ok()) {
          EXPECT_TRUE(status.error_code() == grpc::StatusCode::INVALID_ARGUMENT ||
                      status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED)
              << status.error_message() << ": " << parameters.ShortDebugString();
        }
      }
    }
  }
  EXPECT_LT(harness_.TimeUntilIdle(), absl::InfiniteDuration());
}

TEST_P(ExtremeRequests, DemandsTooFineAreRefusedWithTheirReason) {
  v1::MeshParameters parameters = UnitCubeParameters(GetParam());
  parameters.set_max_circumradius(1e-103);
  const grpc::Status status = MeshOf(harness_, parameters);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailsOf(status).reason, "DEMANDS_TOO_FINE");
  EXPECT_EQ(DetailsOf(status).field, "parameters.max_circumradius");
  EXPECT_NE(status.error_message().find("the smallest size that fits is about "), std::string::npos)
      << status.error_message();
}

TEST(Refinement, OfDemandsThatAreTooFineEndsAtOnce) {
  ServiceHarness harness(core::MeshPoints);
  SessionCalls calls(harness.channel());
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  create.mutable_parameters()->set_max_circumradius(1e-6);
  const std::string name = calls.Create(create).name();
  calls.Upload(name, 0, {0, 0, 1, 1});
  const v1::Operation operation = calls.Refine(name);
  const grpc::Status status(grpc::StatusCode::RESOURCE_EXHAUSTED, "", operation.error().SerializeAsString());
  EXPECT_EQ(DetailsOf(status).reason, "DEMANDS_TOO_FINE");
}

// Uploaded in pieces or at once, at one refinement or later.
TEST(MergeDistance, HoldsForASession) {
  ServiceHarness harness(core::MeshPoints);
  SessionCalls calls(harness.channel());
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  create.mutable_parameters()->set_merge_distance(1e-6);
  const v1::Session session = calls.Create(create);
  EXPECT_EQ(session.parameters().merge_distance(), 1e-6);
  const std::string& name = session.name();
  calls.Upload(name, 0, {0, 0, 1, 1});
  calls.Upload(name, 2, {1 + 1e-9, 1, 0.25, 0.75});
  EXPECT_EQ(calls.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  calls.Upload(name, 4, {0.25, 0.75 - 1e-9});
  EXPECT_EQ(calls.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  const Download download = calls.DownloadMesh(name);
  ASSERT_EQ(download.metadata.size(), 1u);
  EXPECT_EQ(download.metadata[0].statistics().merged_points(), 2u);
  EXPECT_EQ(download.metadata[0].statistics().duplicates(), 0u);
  std::vector<uint32_t> input_vertices;
  for (const v1::MeshChunk& chunk : download.chunks) {
    input_vertices.insert(input_vertices.end(), chunk.input_vertices().begin(), chunk.input_vertices().end());
  }
  EXPECT_EQ(input_vertices, (std::vector<uint32_t>{0, 1, 1, 2, 2}));

  v1::StartRefinementRequest request;
  request.set_name(name);
  request.mutable_parameters()->set_dimension(2);
  request.mutable_parameters()->set_merge_distance(1e-3);
  grpc::Status status;
  calls.Start(request, &status);
  EXPECT_EQ(DetailsOf(status).field, "parameters.merge_distance");
}

}  // namespace
}  // namespace wellspace::server
