// Sizes at points of sessions, and refinements that begin anew.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/meshers/mesher.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

class SetSizesTest : public ::testing::Test {
 protected:
  explicit SetSizesTest(const ServiceOptions& options = {})
      : harness_(core::MeshPoints, options, Transport::kInProcess, core::EstimateMesh, core::Mesher::Create),
        calls_(harness_.channel()) {}

  // A session with points in the unit square.
  std::string Create(size_t count = 50) {
    std::string name = calls_.Create(2).name();
    calls_.Upload(name, 0, UniformPoints(count, 2, 3));
    return name;
  }

  static v1::StartRefinementRequest Restart(const std::string& name) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    request.set_restart(true);
    return request;
  }

  struct Mesh {
    std::vector<double> points;
    std::vector<uint32_t> simplices;

    size_t vertices() const { return points.size() / 2; }
    bool operator==(const Mesh&) const = default;
  };
  Mesh MeshOf(const std::string& name) {
    const Download download = calls_.DownloadMesh(name);
    EXPECT_TRUE(download.status.ok()) << download.status.error_message();
    Mesh mesh;
    for (const v1::MeshChunk& chunk : download.chunks) {
      mesh.points.insert(mesh.points.end(), chunk.points().begin(), chunk.points().end());
      mesh.simplices.insert(mesh.simplices.end(), chunk.simplices().begin(), chunk.simplices().end());
    }
    return mesh;
  }

  // Has a session refuse `requests`, and expects it to be as it was.
  void ExpectRefused(const std::vector<v1::SetSizesRequest>& requests, grpc::StatusCode code, const std::string& reason,
                     const std::string& field, const std::string& message) {
    const v1::Session before = calls_.Get(requests[0].name());
    grpc::Status status;
    calls_.SetSizes(requests, &status);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(DetailsOf(status).reason, reason) << status.error_message();
    EXPECT_EQ(DetailsOf(status).field, field) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(message));
    const v1::Session after = calls_.Get(requests[0].name());
    EXPECT_EQ(after.revision(), before.revision());
    EXPECT_EQ(after.size_count(), before.size_count());
  }

  ServiceHarness harness_;
  SessionCalls calls_;
};

// The mesh that the core makes of the points of Create and these sizes in one call.
core::Mesh MeshAtOnce(const std::vector<double>& points, const std::vector<double>& sizes) {
  core::MeshParameters parameters{.dimension = 2, .domain_low = {0, 0}, .domain_high = {1, 1}};
  parameters.size_samples = std::make_shared<const core::SizeSamples>(
      core::SizeSamples{.points = points, .sizes = sizes, .measure = core::SizeMeasure::kCircumradius});
  core::RunContext context;
  return core::MeshPoints(parameters, UniformPoints(50, 2, 3), context).value();
}

TEST_F(SetSizesTest, TheMeshIsTheOneThatMeshPointsMakes) {
  const std::string name = Create();
  const uint64_t revision = calls_.Get(name).revision();
  const v1::SetSizesResponse set = calls_.SetSizes(
      {SizesRequest(name, {0.25, 0.5}, {0.01}), SizesRequest("", {0.75, 0.5}, {0.02}), SizesRequest("", {}, {})});
  EXPECT_EQ(set.size_count(), 2u);
  EXPECT_EQ(set.revision(), revision + 1);
  const v1::Session session = calls_.Get(name);
  EXPECT_EQ(session.size_count(), 2u);
  EXPECT_EQ(session.revision(), revision + 1);
  calls_.Refine(name);
  const core::Mesh expected = MeshAtOnce({0.25, 0.5, 0.75, 0.5}, {0.01, 0.02});
  const Mesh mesh = MeshOf(name);
  EXPECT_TRUE(std::ranges::equal(mesh.points, expected.points));
  EXPECT_TRUE(std::ranges::equal(mesh.simplices, expected.simplices));
}

TEST_F(SetSizesTest, HoldUntilOthersCome) {
  const std::string name = Create();
  calls_.SetSizes({SizesRequest(name, {0.5, 0.5}, {0.02})});
  calls_.Refine(name);
  const size_t first = MeshOf(name).vertices();
  calls_.Refine(name);
  EXPECT_EQ(MeshOf(name).vertices(), first) << "the sizes are kept";
  calls_.SetSizes({SizesRequest(name, {0.5, 0.5}, {0.005})});
  calls_.Refine(name);
  const size_t second = MeshOf(name).vertices();
  EXPECT_GT(second, first + 20);
  v1::SetSizesRequest none;
  none.set_name(name);
  EXPECT_EQ(calls_.SetSizes({none}).size_count(), 0u);
  calls_.Refine(Restart(name));
  EXPECT_LT(MeshOf(name).vertices(), first);
}

TEST_F(SetSizesTest, TheSameAgainChangesNothing) {
  const std::string name = Create();
  const v1::SetSizesRequest request = SizesRequest(name, {0.5, 0.5}, {0.02});
  const v1::SetSizesResponse first = calls_.SetSizes({request});
  EXPECT_EQ(calls_.SetSizes({request}).revision(), first.revision());
  v1::SetSizesRequest late = request;  // a repetition, whose first answer was lost
  late.set_expected_revision(first.revision() - 1);
  EXPECT_EQ(calls_.SetSizes({late}).revision(), first.revision());
  v1::SetSizesRequest edges = request;
  edges.mutable_samples()->set_measure(v1::SIZE_MEASURE_EDGE_LENGTH);
  EXPECT_EQ(calls_.SetSizes({edges}).revision(), first.revision() + 1);
}

TEST_F(SetSizesTest, TheSameAgainAtAnotherRevisionIsRefused) {
  const std::string name = Create();
  v1::SetSizesRequest none;
  none.set_name(name);
  v1::SetSizesRequest request = SizesRequest(name, {0.5, 0.5}, {0.02});
  const auto expect_refused = [&](v1::SetSizesRequest& again, uint64_t revision) {
    again.set_expected_revision(revision);
    ExpectRefused({again}, grpc::StatusCode::ABORTED, "REVISION_MISMATCH", "",
                  absl::StrCat("expected_revision is ", revision));
  };
  const uint64_t before = calls_.Get(name).revision();
  expect_refused(none, before + 1);
  expect_refused(none, before + 1000);
  none.set_expected_revision(before);
  EXPECT_EQ(calls_.SetSizes({none}).revision(), before) << "there were none";
  const uint64_t set = calls_.SetSizes({request}).revision();
  expect_refused(request, set + 1);
  calls_.Upload(name, calls_.Get(name).committed_points(), {0.31, 0.32});
  const uint64_t now = calls_.Get(name).revision();
  ASSERT_EQ(now, set + 1);
  expect_refused(request, set);
  for (const uint64_t right : {now, before}) {  // the latter is that of a repetition
    request.set_expected_revision(right);
    EXPECT_EQ(calls_.SetSizes({request}).revision(), now);
  }
  none.set_expected_revision(now);
  EXPECT_EQ(calls_.SetSizes({none}).revision(), now + 1);
  EXPECT_EQ(calls_.SetSizes({none}).revision(), now + 1) << "a repetition";
  expect_refused(none, set);
}

TEST_F(SetSizesTest, OfTheVerticesOfItsMesh) {
  const std::string name = Create();
  calls_.Refine(name);
  const Mesh before = MeshOf(name);
  std::vector<double> sizes;
  for (size_t i = 0; i < before.vertices(); ++i) {
    sizes.push_back(0.01 + 0.1 * before.points[2 * i]);
  }
  v1::SetSizesRequest first;
  first.set_name(name);
  first.mutable_vertex_sizes()->set_mesh_revision(calls_.Get(name).revision());
  first.mutable_vertex_sizes()->mutable_sizes()->Assign(sizes.begin(), sizes.begin() + 7);
  v1::SetSizesRequest second;
  second.mutable_vertex_sizes()->mutable_sizes()->Assign(sizes.begin() + 7, sizes.end());
  EXPECT_EQ(calls_.SetSizes({first, second}).size_count(), sizes.size());
  calls_.Refine(Restart(name));
  const core::Mesh expected = MeshAtOnce(before.points, sizes);
  EXPECT_TRUE(std::ranges::equal(MeshOf(name).points, expected.points));
}

TEST_F(SetSizesTest, OfOtherVerticesAreRefused) {
  const std::string name = Create();
  v1::SetSizesRequest request;
  request.set_name(name);
  request.mutable_vertex_sizes()->add_sizes(0.1);
  ExpectRefused({request}, grpc::StatusCode::FAILED_PRECONDITION, "MESH_NOT_READY", "", "no mesh yet");
  calls_.Refine(name);
  ExpectRefused({request}, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_SIZES", "vertex_sizes.sizes",
                "there are 1, but the mesh has ");
  request.mutable_vertex_sizes()->set_mesh_revision(1);
  ExpectRefused({request}, grpc::StatusCode::ABORTED, "REVISION_MISMATCH", "", "mesh_revision is 1");
}

TEST_F(SetSizesTest, BadSamplesAreRefusedByTheirNumber) {
  const std::string name = Create();
  const v1::SetSizesRequest good = SizesRequest(name, {0.5, 0.5}, {0.1});
  const auto refused = [&](const v1::SetSizesRequest& bad, const std::string& reason, const std::string& field,
                           const std::string& message) {
    ExpectRefused({good, bad}, grpc::StatusCode::INVALID_ARGUMENT, reason, field, message);
  };
  for (const double size : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    refused(SizesRequest("", {0, 0, 1, 1}, {1, size}), "INVALID_SIZES", "samples.sizes", "samples.sizes[2]");
  }
  refused(SizesRequest("", {0, std::nan("")}, {1}), "INVALID_SIZES", "samples.points", "samples.points[1]");
  refused(SizesRequest("", {0.5, 1.5}, {1}), "INVALID_SIZES", "samples.points",
          "samples.points[1]: coordinate 1 is 1.5; in the domain it is from 0 to 1");
  refused(SizesRequest("", {0.5}, {1}), "INVALID_CHUNK_SHAPE", "samples.points", "1 coordinates for 1 sizes");
  v1::SetSizesRequest unit = SizesRequest("", {0, 0}, {1});
  unit.mutable_samples()->set_measure(static_cast<v1::SizeMeasure>(7));
  refused(unit, "INVALID_SIZES", "samples.measure", "7");
  v1::SetSizesRequest of_vertices;
  of_vertices.mutable_vertex_sizes()->add_sizes(1);
  refused(of_vertices, "INVALID_SIZES", "vertex_sizes", "samples as well as vertex_sizes");
  grpc::Status status;
  calls_.SetSizes({}, &status);
  EXPECT_EQ(DetailsOf(status).reason, "EMPTY_REQUEST");
  v1::SetSizesRequest late = good;
  late.set_expected_revision(77);
  ExpectRefused({late}, grpc::StatusCode::ABORTED, "REVISION_MISMATCH", "", "77");
}

TEST_F(SetSizesTest, SizesOfEveryExponentEnd) {
  const std::string name = Create();
  v1::StartRefinementRequest refine = Restart(name);
  refine.mutable_parameters()->set_dimension(2);
  refine.mutable_parameters()->set_max_vertices(2000);
  for (const v1::SizeMeasure measure : {v1::SIZE_MEASURE_CIRCUMRADIUS, v1::SIZE_MEASURE_EDGE_LENGTH}) {
    for (int exponent = -1074; exponent < 1024; exponent += 61) {
      v1::SetSizesRequest sizes = SizesRequest(name, {0.5, 0.5, 0.25, 0.5}, {std::ldexp(1, exponent), 1});
      sizes.mutable_samples()->set_measure(measure);
      calls_.SetSizes({sizes});
      const v1::Operation operation = calls_.Refine(refine);
      if (exponent > 0) {
        EXPECT_EQ(operation.state(), v1::Operation::STATE_SUCCEEDED) << exponent;
      } else if (exponent < -100) {
        EXPECT_EQ(operation.state(), v1::Operation::STATE_FAILED) << exponent;
        EXPECT_EQ(operation.error().code(), static_cast<int>(grpc::StatusCode::RESOURCE_EXHAUSTED)) << exponent;
      }
    }
  }
}

// Where the box is that of the points, only the refinement knows it.
TEST_F(SetSizesTest, OutsideTheBoxOfThePointsAreUsed) {
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  const std::string name = calls_.Create(create).name();
  calls_.Upload(name, 0, UniformPoints(50, 2, 3));
  calls_.Refine(name);
  const Mesh coarse = MeshOf(name);
  calls_.SetSizes({SizesRequest(name, {0.5, 0.5, 1.01, 0.5}, {1, 0.001})});
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(calls_.Get(name).size_count(), 2u);
  EXPECT_GT(MeshOf(name).points.size(), 2 * coarse.points.size()) << "a size beside the box counts within";
}

TEST_F(SetSizesTest, RestartMakesTheMeshOfItsPointsAlone) {
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  const std::string name = calls_.Create(create).name();
  calls_.Upload(name, 0, UniformPoints(50, 2, 3));
  calls_.Refine(name);
  const Mesh coarse = MeshOf(name);
  for (int i = 0; i < 4; ++i) {
    calls_.SetSizes({SizesRequest(name, {0.2 + 0.15 * i, 0.5}, {0.004})});
    calls_.Refine(name);
  }
  const Mesh grown = MeshOf(name);
  v1::StartRefinementRequest restart = Restart(name);
  const v1::Operation operation = calls_.Refine(restart);
  EXPECT_TRUE(operation.restart());
  const Mesh anew = MeshOf(name);
  EXPECT_LT(anew.vertices(), grown.vertices() * 2 / 3);
  calls_.SetSizes({[&] {
    v1::SetSizesRequest none;
    none.set_name(name);
    return none;
  }()});
  calls_.Refine(restart);
  EXPECT_TRUE(MeshOf(name) == coarse) << "to the bit, in the same box";
}

// Points that were added lie in the margin: the box is the one that it was.
TEST_F(SetSizesTest, RestartKeepsTheBoxAndThePointsThatWereAdded) {
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  create.mutable_parameters()->set_margin(0.5);
  const std::string name = calls_.Create(create).name();
  calls_.Upload(name, 0, UniformPoints(50, 2, 3));
  calls_.Refine(name);
  const v1::MeshMetadata before = calls_.DownloadMesh(name).metadata.at(0);
  calls_.Upload(name, 50, {before.domain().low(0) + 0.01, 0.5});
  calls_.Refine(Restart(name));
  const v1::MeshMetadata after = calls_.DownloadMesh(name).metadata.at(0);
  EXPECT_EQ(after.domain().DebugString(), before.domain().DebugString());
  const Mesh mesh = MeshOf(name);
  EXPECT_EQ(mesh.points[2 * 50], before.domain().low(0) + 0.01) << "vertices are numbered by points first";
}

TEST_F(SetSizesTest, SizesOfASessionThatIsRefinedAreRefused) {
  const std::string name = Create(20'000);
  const v1::Operation started = calls_.Start(name);
  ExpectRefused({SizesRequest(name, {0.5, 0.5}, {1})}, grpc::StatusCode::FAILED_PRECONDITION, "SESSION_BUSY", "",
                "under way");
  calls_.Cancel(started.name());
}

class FewSizesTest : public SetSizesTest {
 protected:
  FewSizesTest() : SetSizesTest({.max_points = 100, .max_points_per_tenant = 150}) {}
};

TEST_F(FewSizesTest, CountAsPointsDo) {
  const std::string name = Create();
  const auto request = [&](size_t count) {
    return SizesRequest(name, UniformPoints(count, 2, 5), std::vector<double>(count, 0.5));
  };
  ExpectRefused({request(101)}, grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_POINTS", "", "101");
  EXPECT_EQ(calls_.SetSizes({request(100)}).size_count(), 100u);
  // Those that are replaced, and that no refinement has kept to, count no longer.
  for (size_t count = 40; count < 50; ++count) {
    EXPECT_EQ(calls_.SetSizes({request(count)}).size_count(), count);
  }
  calls_.Refine(name);
  EXPECT_EQ(calls_.SetSizes({request(50)}).size_count(), 50u);
  calls_.Refine(name);
  ExpectRefused({request(51)}, grpc::StatusCode::RESOURCE_EXHAUSTED, "QUOTA_EXCEEDED", "", "at most 150");
  calls_.Refine(Restart(name));
  EXPECT_EQ(calls_.SetSizes({request(49)}).size_count(), 49u) << "a restart needs only the last";
}

}  // namespace
}  // namespace wellspace::server
