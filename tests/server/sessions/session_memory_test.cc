// Sessions on a server with little memory: "refinement that eats the memory" ends with figures, and nothing else ends
// with it.
#include <optional>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "wellspace/v1/queries.grpc.pb.h"

namespace wellspace::server {
namespace {

constexpr size_t kPiece = 40'000;  // points of a message

class SessionMemoryTest : public ::testing::Test {
 protected:
  // Refines with circumradii of at most `size`, if it is given.
  v1::Operation Refine(const std::string& name, std::optional<double> size = std::nullopt) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    *request.mutable_parameters() = UnitCubeParameters();
    if (size.has_value()) {
      request.mutable_parameters()->set_max_circumradius(*size);
    }
    Watch watch(calls_.operations(), calls_.Start(request).name());
    EXPECT_TRUE(watch.Finish().ok());
    return watch.operation.value_or(v1::Operation());
  }

  // Creates a session whose points take two thirds of the memory.
  std::string TakeMostOfTheMemory() {
    const std::string name = calls_.Create().name();
    std::vector<v1::UploadPointsRequest> requests;
    for (uint64_t offset = 0; offset < 45 * kPiece; offset += kPiece) {
      requests.push_back(UploadRequest(name, offset, std::vector<double>(3 * kPiece, 0.5)));
    }
    calls_.Upload(requests);
    return name;
  }

  void ExpectMemoryLimit(const v1::Operation& operation) {
    EXPECT_EQ(operation.state(), v1::Operation::STATE_FAILED);
    EXPECT_EQ(operation.error().code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    const grpc::Status status(grpc::StatusCode::RESOURCE_EXHAUSTED, "", operation.error().SerializeAsString());
    EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT") << operation.error().message();
  }

  v1::AddVerticesResponse AddVertices(const std::string& name, const std::vector<double>& points,
                                      grpc::Status* status) {
    v1::AddVerticesRequest request;
    request.set_name(name);
    request.mutable_points()->Add(points.begin(), points.end());
    grpc::ClientContext context;
    v1::AddVerticesResponse response;
    *status = v1::QueryService::NewStub(harness_.channel())->AddVertices(&context, request, &response);
    return response;
  }

  ServiceHarness harness_{core::MeshPoints, {.max_memory_bytes = kMinMemoryBytes}};
  SessionCalls calls_{harness_.channel()};
};

TEST_F(SessionMemoryTest, ARefinementThatNeedsTooMuchFailsAndLeavesTheSessionAsItWas) {
  TakeMostOfTheMemory();  // the rest is used up sooner
  const std::string name = calls_.Create().name();
  calls_.Upload(name, 0, UniformPoints(1000, 3, 5));
  ExpectMemoryLimit(Refine(name, 0.004));
  v1::Session session = calls_.Get(name);
  EXPECT_EQ(session.state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(session.committed_points(), 1000u);
  EXPECT_EQ(Refine(name).state(), v1::Operation::STATE_SUCCEEDED) << "with less it goes";

  const uint64_t vertices = calls_.Get(name).vertex_count();
  ExpectMemoryLimit(Refine(name, 0.004));  // no estimate now: it has to grow until it is stopped
  session = calls_.Get(name);
  EXPECT_EQ(session.state(), v1::Session::STATE_READY);
  EXPECT_EQ(session.committed_points(), 1000u);
  EXPECT_EQ(session.vertex_count(), vertices) << "the last mesh is there still";
  EXPECT_EQ(Refine(name).state(), v1::Operation::STATE_SUCCEEDED) << "built again";
  EXPECT_EQ(calls_.Get(name).vertex_count(), vertices) << "and the same";
  ExpectMemoryLimit(Refine(name, 0.004));
  grpc::Status status;
  AddVertices(name, {0.5, 0.5, 0.5}, &status);
  EXPECT_TRUE(status.ok()) << "the structure that was given up is built again: " << status.error_message();
}

TEST_F(SessionMemoryTest, VerticesThatAreAddedAreCounted) {
  const std::string other = TakeMostOfTheMemory();
  const std::string name = calls_.Create().name();
  calls_.Upload(name, 0, UniformPoints(1000, 3, 5));
  Refine(name);
  grpc::Status status;
  uint64_t added = 0;
  for (uint64_t seed = 0; status.ok(); ++seed) {
    added += AddVertices(name, UniformPoints(2000, 3, seed), &status).vertices_size();
  }
  EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT") << status.error_message();
  EXPECT_GT(added, 2000u);
  EXPECT_LT(added, 400'000u) << "as points alone there would be room for more";
  EXPECT_EQ(calls_.Get(name).committed_points(), 1000 + added) << "those that were refused are none of the session's";
  calls_.Delete(other);
  do {
    AddVertices(name, UniformPoints(2000, 3, 0), &status);  // the memory is free shortly after
  } while (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(SessionMemoryTest, ADeletedSessionMakesRoomForOthers) {
  const std::vector<double> piece = UniformPoints(kPiece, 3, 7);
  const std::string first = calls_.Create().name();
  grpc::Status status;
  uint64_t committed = 0;
  for (; status.ok(); committed += kPiece) {
    calls_.Upload(first, committed, piece, &status);
  }
  EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT") << status.error_message();
  EXPECT_EQ(calls_.Get(first).committed_points(), committed - kPiece);
  const std::string second = calls_.Create().name();
  calls_.Upload(second, 0, piece, &status);
  EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT") << status.error_message();
  calls_.Delete(first);
  do {
    calls_.Upload(second, 0, piece, &status);  // the memory is free shortly after
  } while (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

}  // namespace
}  // namespace wellspace::server
