// Points located in the meshes of sessions.
#include <cmath>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

class LocateTest : public ::testing::Test {
 protected:
  explicit LocateTest(const ServiceOptions& options = {})
      : harness_(core::MeshPoints, options, Transport::kInProcess, core::EstimateMesh, core::Mesher::Create),
        calls_(harness_.channel()) {}

  std::string CreateRefined() {
    std::string name = calls_.Create(2).name();
    calls_.Upload(name, 0, UniformPoints(50, 2, 3));
    calls_.Refine(name);
    return name;
  }

  grpc::Status Locate(const v1::LocateRequest& request) {
    grpc::ClientContext context;
    response_.Clear();
    return calls_.queries().Locate(&context, request, &response_);
  }
  void ExpectRefused(const v1::LocateRequest& request, grpc::StatusCode code, const std::string& reason,
                     const std::string& message) {
    const grpc::Status status = Locate(request);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(DetailsOf(status).reason, reason) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(message));
  }

  ServiceHarness harness_;
  SessionCalls calls_;
  v1::LocateResponse response_;
};

v1::LocateRequest At(const std::string& name, const std::vector<double>& points) {
  v1::LocateRequest request;
  request.set_name(name);
  request.mutable_points()->Assign(points.begin(), points.end());
  return request;
}

TEST_F(LocateTest, PlacesAddUpToThePoints) {
  const std::string name = CreateRefined();
  const Download mesh = calls_.DownloadMesh(name);
  const std::vector<double> points = UniformPoints(300, 2, 8);
  const grpc::Status status = Locate(At(name, points));
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response_.revision(), mesh.metadata.at(0).revision());
  EXPECT_EQ(response_.vertex_count(), mesh.metadata.at(0).vertex_count());
  ASSERT_EQ(response_.simplices_size(), 300);
  ASSERT_EQ(response_.vertices_size(), 900);
  ASSERT_EQ(response_.coordinates_size(), 900);
  std::vector<double> vertices;
  std::vector<uint32_t> simplices;
  for (const v1::MeshChunk& chunk : mesh.chunks) {
    vertices.insert(vertices.end(), chunk.points().begin(), chunk.points().end());
    simplices.insert(simplices.end(), chunk.simplices().begin(), chunk.simplices().end());
  }
  for (int i = 0; i < 300; ++i) {
    double x = 0;
    double y = 0;
    for (int k = 3 * i; k < 3 * i + 3; ++k) {
      EXPECT_EQ(response_.vertices(k), simplices.at(3 * response_.simplices(i) + k % 3));
      x += response_.coordinates(k) * vertices.at(2 * response_.vertices(k));
      y += response_.coordinates(k) * vertices.at(2 * response_.vertices(k) + 1);
    }
    EXPECT_NEAR(x, points[2 * i], 1e-14);
    EXPECT_NEAR(y, points[2 * i + 1], 1e-14);
  }
}

TEST_F(LocateTest, TheMeshIsTheLastOneWhateverIsUnderWay) {
  const std::string name = CreateRefined();
  const uint64_t revision = calls_.DownloadMesh(name).metadata.at(0).revision();
  ASSERT_TRUE(Locate(At(name, {0.5, 0.5})).ok());
  calls_.Upload(name, 50, UniformPoints(20'000, 2, 5));
  EXPECT_TRUE(Locate(At(name, {0.5, 0.5})).ok());
  EXPECT_EQ(response_.revision(), revision);
  const v1::Operation started = calls_.Start(name);
  EXPECT_TRUE(Locate(At(name, {0.5, 0.5})).ok());
  Watch watch(calls_.operations(), started.name());
  EXPECT_TRUE(watch.Finish().ok());
  EXPECT_TRUE(Locate(At(name, {0.5, 0.5})).ok());
  EXPECT_GT(response_.revision(), revision);
}

TEST_F(LocateTest, ErrorsNameThePoint) {
  const std::string fresh = calls_.Create(2).name();
  ExpectRefused(At(fresh, {0.5, 0.5}), grpc::StatusCode::FAILED_PRECONDITION, "MESH_NOT_READY", "no mesh yet");
  ExpectRefused(At("sessions/none", {0.5, 0.5}), grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND", "");
  const std::string name = CreateRefined();
  ExpectRefused(At(name, {0.5}), grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CHUNK_SHAPE", "1 coordinates");
  v1::LocateRequest outside = At(name, {0.5, 0.5, 7, 0.5});
  outside.set_point_offset(100);
  ExpectRefused(outside, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points[101] lies in no simplex");
  outside.set_allow_outside(true);
  EXPECT_TRUE(Locate(outside).ok());
  EXPECT_EQ(response_.simplices(1), 0xffff'ffffu);
  v1::LocateRequest none = At(name, {0.5, 0.5, 0.5, std::nan("")});
  none.set_point_offset(100);
  ExpectRefused(none, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points[101]: coordinate 1 is nan");
  v1::LocateRequest old = At(name, {0.5, 0.5});
  old.set_revision(1);
  ExpectRefused(old, grpc::StatusCode::ABORTED, "REVISION_MISMATCH", "revision is 1");
  old.set_revision(0);
  ExpectRefused(old, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "revision is 0; revisions begin with 1");
  ExpectRefused(At(name, std::vector<double>(2 * 32'769, 0.5)), grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST",
                "at most 32768");
  EXPECT_TRUE(Locate(At(name, {})).ok());
}

TEST_F(LocateTest, CoordinatesOfEveryExponentEnd) {
  const std::string name = CreateRefined();
  for (int exponent = -1074; exponent < 1024; exponent += 13) {
    for (const double sign : {1.0, -1.0}) {
      v1::LocateRequest request = At(name, {sign * std::ldexp(1, exponent), 0.5});
      request.set_allow_outside(true);
      ASSERT_TRUE(Locate(request).ok()) << exponent;
      EXPECT_EQ(response_.simplices(0) == 0xffff'ffffu, sign < 0 || exponent > 0) << exponent;
    }
  }
}

}  // namespace
}  // namespace wellspace::server
