// Operations that refine sessions by the core's own meshers.
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "gtest/gtest.h"
#include "tests/server/patience.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

class RefinedByTheCore : public ::testing::Test {
 protected:
  ServiceHarness harness_{core::MeshPoints};
  SessionCalls calls_{harness_.channel()};
};

TEST_F(RefinedByTheCore, CancelInEveryPhaseIsSeenAndLeavesTheSameMesh) {
  const std::vector<double> points = UniformPoints(8'000, 3, 11);
  const std::string undisturbed = calls_.Create().name();
  const std::string disturbed = calls_.Create().name();
  for (const std::string& name : {undisturbed, disturbed}) {
    calls_.Upload({UploadRequest(name, 0, points)});
  }
  for (const v1::Phase phase : {v1::PHASE_WAITING, v1::PHASE_TREE, v1::PHASE_REFINEMENT, v1::PHASE_SIMPLICES}) {
    const std::string operation = calls_.Start(disturbed).name();
    Watch watch(calls_.operations(), operation);
    ASSERT_TRUE(watch.ReadUntil(phase));
    const absl::Time cancelled = absl::Now();
    const bool had_ended = calls_.Cancel(operation).state() == v1::Operation::STATE_SUCCEEDED;
    EXPECT_TRUE(watch.Finish().ok());
    EXPECT_LE(absl::Now() - cancelled, kIdleWithin) << v1::Phase_Name(phase);
    if (!had_ended) {
      EXPECT_EQ(calls_.Get(disturbed).state(), v1::Session::STATE_OPEN);
      EXPECT_EQ(calls_.Get(disturbed).committed_points(), 8'000u);
    }
  }
  calls_.Refine(undisturbed);
  calls_.Refine(disturbed);
  EXPECT_EQ(calls_.Get(undisturbed).vertex_count(), calls_.Get(disturbed).vertex_count());
  EXPECT_EQ(calls_.Get(undisturbed).simplex_count(), calls_.Get(disturbed).simplex_count());
}

// "A crash on three points, on duplicates".
TEST_F(RefinedByTheCore, FewPointsAndDuplicatesAreNoTrouble) {
  const std::string name = calls_.Create(2).name();
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED) << "no points at all, but a domain";
  calls_.Upload(name, 0, {0.5, 0.5, 0.5, 0.5, 0.5, 0.5});
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  calls_.Upload(name, 3, {0.25, 0.5, 0.5, 0.5, 0.0, 0.0});
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(calls_.Get(name).committed_points(), 6u);
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY);
}

TEST_F(RefinedByTheCore, PointsThatCannotBeMeshedFailTheOperationNotTheServer) {
  const std::string name = calls_.Create(2).name();
  calls_.Upload(name, 0, {0.5, 0.5, 0.5, 0.5 + 1e-15});
  const v1::Operation operation = calls_.Refine(name);
  EXPECT_EQ(operation.state(), v1::Operation::STATE_FAILED);
  const grpc::Status status(grpc::StatusCode::INVALID_ARGUMENT, "", operation.error().SerializeAsString());
  EXPECT_EQ(DetailsOf(status).reason, "INVALID_POINTS") << operation.error().message();
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_OPEN);
}

TEST_F(RefinedByTheCore, TheDomainIsFixedByTheFirstMesh) {
  v1::CreateSessionRequest request;
  request.mutable_parameters()->set_dimension(2);
  const std::string name = calls_.Create(request).name();
  calls_.Upload(name, 0, {0, 0, 4, 4});
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  grpc::Status status;
  calls_.Upload(name, 2, {1, 5, 1, 5.5}, &status);
  EXPECT_EQ(DetailsOf(status).reason, "INVALID_POINTS");
  EXPECT_NE(status.error_message().find("points[3]: coordinate 1 is 5.5; in the domain it is from -1 to 5"),
            std::string::npos)
      << status.error_message();
  calls_.Upload(name, 2, {1, 5});
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
}

TEST_F(RefinedByTheCore, LaterRefinementsAreLocal) {
  const std::string name = calls_.Create(3).name();
  calls_.Upload(name, 0, UniformPoints(5'000, 3, 3));
  calls_.Refine(name);
  const v1::Session before = calls_.Get(name);
  calls_.Upload(name, 5'000, {0.123, 0.456, 0.789});
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  const v1::Session after = calls_.Get(name);
  EXPECT_GT(after.vertex_count(), before.vertex_count());
  EXPECT_LT(after.vertex_count(), before.vertex_count() + 1000);
}

}  // namespace
}  // namespace wellspace::server
