// Domains in space: triangles in MeshPoints and AddTriangles, and their effects.
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

constexpr uint64_t kTriangles = 12;
constexpr uint64_t kPoints = 8;

class TrianglesTest : public ::testing::Test {
 protected:
  explicit TrianglesTest(const ServiceOptions& options = {})
      : harness_(core::MeshPoints, options, Transport::kInProcess, FakeEstimator, core::Mesher::Create),
        calls_(harness_.channel()) {}

  std::string Create(int dimension = 3) {
    v1::CreateSessionRequest request;
    request.mutable_parameters()->set_dimension(dimension);
    return calls_.Create(request).name();
  }
  std::string CreateBlock() {
    const std::string name = Create();
    calls_.Upload(name, 0, BlockPoints());
    calls_.AddTriangles({BlockRequest(name)});
    return name;
  }
  void ExpectError(grpc::StatusCode code, const std::string& reason, const std::string& field = "") {
    EXPECT_EQ(status_.error_code(), code) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).reason, reason) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).field, field) << status_.error_message();
  }
  // Has the session refuse `request`, and expects it to be as it was.
  void ExpectRefused(const v1::AddTrianglesRequest& request, grpc::StatusCode code, const std::string& reason,
                     const std::string& field) {
    const uint64_t revision = calls_.Get(request.name()).revision();
    calls_.AddTriangles({request}, &status_);
    ExpectError(code, reason, field);
    EXPECT_EQ(calls_.Get(request.name()).revision(), revision);
  }
  // The mesh that MeshPoints makes of `triangles` and `surface` over the block's points.
  Download Mesh(const v1::AddTrianglesRequest& block, const v1::MeshParameters& parameters = {}) {
    grpc::ClientContext context;
    const auto stream = harness_.stub().MeshPoints(&context);
    v1::MeshPointsRequest request;
    request.set_with_boundary(true);
    *request.mutable_parameters() = parameters;
    request.mutable_parameters()->set_dimension(3);
    stream->Write(request);
    for (const double x : BlockPoints()) {
      request.mutable_points()->add_coordinates(x);
    }
    stream->Write(request);
    *request.mutable_triangles() = block.triangles();
    stream->Write(request);
    *request.mutable_surface() = block.surface();
    stream->Write(request);
    stream->WritesDone();
    Download download;
    v1::MeshPointsResponse response;
    while (stream->Read(&response)) {
      if (response.has_metadata()) {
        download.metadata.push_back(response.metadata());
      } else if (response.has_chunk()) {
        download.chunks.push_back(response.chunk());
      }
    }
    download.status = stream->Finish();
    return download;
  }

  ServiceHarness harness_;
  SessionCalls calls_;
  grpc::Status status_;
};

TEST_F(TrianglesTest, ASessionHasTheMeshThatMeshPointsMakes) {
  const std::string name = CreateBlock();
  calls_.Refine(name);
  const Download mesh = calls_.DownloadMesh(name, 0, 0, std::nullopt, /*with_boundary=*/true);
  const Download expected = Mesh(BlockRequest(""));
  ASSERT_TRUE(mesh.status.ok()) << mesh.status.error_message();
  ASSERT_TRUE(expected.status.ok()) << expected.status.error_message();
  ASSERT_EQ(mesh.metadata.size(), 1u);
  const v1::MeshMetadata& metadata = mesh.metadata[0];
  ASSERT_EQ(metadata.boundary_size(), 6);
  EXPECT_EQ(metadata.boundary(0).name(), "marker_1");
  const v1::SurfaceStatistics& surface = metadata.statistics().surface();
  EXPECT_EQ(surface.triangles(), kTriangles);
  EXPECT_EQ(surface.curves(), 12u);
  EXPECT_EQ(surface.corners(), 8u);
  EXPECT_EQ(surface.solids(), 1u);
  EXPECT_EQ(surface.lost_ridges(), 0u);
  EXPECT_EQ(surface.facets(), metadata.facet_count());
  EXPECT_EQ(surface.ridges(), metadata.ridge_count());
  EXPECT_GE(metadata.ridge_count(), 12u);
  ASSERT_EQ(surface.volumes_size(), 1);
  EXPECT_NEAR(surface.volumes(0), 1, 1e-12);
  ASSERT_EQ(mesh.chunks.size(), expected.chunks.size());
  uint64_t ridges = 0;
  for (size_t i = 0; i < mesh.chunks.size(); ++i) {
    EXPECT_EQ(mesh.chunks[i].SerializeAsString(), expected.chunks[i].SerializeAsString()) << i;
    ridges += mesh.chunks[i].ridges_size() / 2;
  }
  EXPECT_EQ(ridges, metadata.ridge_count());
}

TEST_F(TrianglesTest, TheSessionSaysWhatItHas) {
  const std::string name = Create();
  EXPECT_FALSE(calls_.Get(name).has_surface()) << "a cloud";
  const v1::AddTrianglesResponse added = calls_.AddTriangles({BlockRequest(name)});
  EXPECT_EQ(added.triangle_count(), kTriangles);
  EXPECT_EQ(added.seed_count(), 1u);
  const v1::Session session = calls_.Get(name);
  EXPECT_EQ(session.triangle_count(), kTriangles);
  EXPECT_EQ(session.segment_count(), 0u);
  EXPECT_EQ(session.seed_count(), 1u);
  EXPECT_EQ(session.surface().solids(), v1::SOLID_RULE_HOLES);
  EXPECT_EQ(session.surface().crease_angle(), 30) << "the default";
  EXPECT_EQ(session.surface().seeds_size(), 0);
  EXPECT_EQ(session.revision(), added.revision());
}

// Of a request, the triangles and the seeds from a number on.
v1::AddTrianglesRequest From(const v1::AddTrianglesRequest& request, int triangle, int seed) {
  v1::AddTrianglesRequest part = request;
  part.set_triangle_offset(triangle);
  part.set_seed_offset(seed);
  auto& corners = *part.mutable_triangles()->mutable_corners();
  auto& markers = *part.mutable_triangles()->mutable_markers();
  corners.erase(corners.begin(), corners.begin() + 3 * triangle);
  markers.erase(markers.begin(), markers.begin() + triangle);
  part.mutable_surface()->mutable_seeds()->DeleteSubrange(0, seed);
  return part;
}

TEST_F(TrianglesTest, TrianglesComeInAnyPiecesAndAreNeverTakenTwice) {
  const std::string name = Create();
  const v1::AddTrianglesRequest whole = BlockRequest(name);
  v1::AddTrianglesRequest start = whole;
  start.mutable_triangles()->mutable_corners()->Truncate(9);
  start.mutable_triangles()->mutable_markers()->Truncate(3);
  start.mutable_surface()->clear_seeds();
  EXPECT_EQ(calls_.AddTriangles({start}).triangle_count(), 3u);
  const v1::AddTrianglesResponse added = calls_.AddTriangles({start, From(whole, 2, 0), From(whole, kTriangles, 1)});
  EXPECT_EQ(added.triangle_count(), kTriangles);
  EXPECT_EQ(added.seed_count(), 1u);
  for (const v1::AddTrianglesRequest& again : {whole, start, From(whole, 9, 0)}) {
    const v1::AddTrianglesResponse repeated = calls_.AddTriangles({again});
    EXPECT_EQ(repeated.triangle_count(), kTriangles);
    EXPECT_EQ(repeated.revision(), added.revision()) << "nothing has changed";
  }
  calls_.Upload(name, 0, BlockPoints());
  calls_.Refine(name);
  EXPECT_EQ(calls_.AddTriangles({whole}).triangle_count(), kTriangles) << "a retry may come late";
}

TEST_F(TrianglesTest, OthersInTheSamePlaceAreRefused) {
  const std::string name = CreateBlock();
  const v1::AddTrianglesRequest whole = BlockRequest(name);
  v1::AddTrianglesRequest other = whole;
  other.mutable_triangles()->set_corners(7, 5);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "triangles.corners");
  EXPECT_THAT(status_.error_message(), HasSubstr("triangles[2]"));
  other = From(whole, 4, 0);
  other.mutable_triangles()->set_markers(3, 8);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "triangles.corners");
  EXPECT_THAT(status_.error_message(), HasSubstr("triangles[7]"));
  other = whole;
  other.mutable_surface()->mutable_seeds(0)->set_region(5);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "surface.seeds");
  other = whole;
  other.set_triangle_offset(kTriangles + 1);
  ExpectRefused(other, grpc::StatusCode::OUT_OF_RANGE, "UPLOAD_GAP", "triangle_offset");
  other = From(whole, kTriangles, 1);
  other.set_seed_offset(2);
  ExpectRefused(other, grpc::StatusCode::OUT_OF_RANGE, "UPLOAD_GAP", "seed_offset");
}

TEST_F(TrianglesTest, WhatIsNotValidIsRefusedAsAWhole) {
  const std::string name = Create();
  v1::AddTrianglesRequest bad = BlockRequest(name);
  bad.mutable_triangles()->add_corners(1);
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CHUNK_SHAPE", "triangles.corners");
  bad = BlockRequest(name);
  bad.mutable_triangles()->add_markers(1);
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CHUNK_SHAPE", "triangles.markers");
  bad = BlockRequest(name);
  bad.mutable_surface()->set_solids(static_cast<v1::SolidRule>(9));
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_TRIANGLES", "surface.solids");
  bad = BlockRequest(name);
  bad.mutable_surface()->set_weld(-1);
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_TRIANGLES", "surface.weld");
  bad = BlockRequest(name);
  bad.mutable_surface()->mutable_seeds(0)->set_z(std::nan(""));
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_TRIANGLES", "surface.seeds");
  EXPECT_EQ(calls_.Get(name).triangle_count(), 0u);

  ExpectRefused(BlockRequest(Create(2)), grpc::StatusCode::INVALID_ARGUMENT, "INVALID_TRIANGLES", "triangles");
  calls_.AddTriangles({}, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "EMPTY_REQUEST", "name");
}

TEST_F(TrianglesTest, WhatAllOfItShowsFailsTheFirstRefinementWhichMayBeTriedAgain) {
  const std::string name = Create();
  calls_.Upload(name, 0, BlockPoints());
  v1::AddTrianglesRequest open = BlockRequest(name);
  open.mutable_triangles()->mutable_corners()->Truncate(3 * (kTriangles - 1));
  open.mutable_triangles()->mutable_markers()->Truncate(kTriangles - 1);
  open.mutable_surface()->set_solids(v1::SOLID_RULE_EVEN_ODD);
  calls_.AddTriangles({open});
  const v1::Operation failed = calls_.Refine(name);
  ASSERT_EQ(failed.state(), v1::Operation::STATE_FAILED);
  EXPECT_THAT(failed.error().message(), HasSubstr("open edges"));
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_OPEN);
  calls_.AddTriangles({From(BlockRequest(name), kTriangles - 1, 1)});
  EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
}

TEST_F(TrianglesTest, APeriodicSessionHasNone) {
  v1::CreateSessionRequest request;
  request.mutable_parameters()->set_dimension(3);
  request.mutable_parameters()->add_periodic_axes(0);
  const std::string name = calls_.Create(request).name();
  calls_.Upload(name, 0, BlockPoints());
  ExpectRefused(BlockRequest(name), grpc::StatusCode::INVALID_ARGUMENT, "INVALID_TRIANGLES", "triangles");
  EXPECT_THAT(status_.error_message(), HasSubstr("periodic_axes"));
}

TEST_F(TrianglesTest, TrianglesComeBeforeTheFirstRefinement) {
  const std::string name = CreateBlock();
  calls_.Refine(name);
  v1::AddTrianglesRequest more;
  more.set_name(name);
  more.set_triangle_offset(kTriangles);
  for (const uint32_t corner : {0, 3, 5}) {
    more.mutable_triangles()->add_corners(corner);
  }
  ExpectRefused(more, grpc::StatusCode::FAILED_PRECONDITION, "DOMAIN_FIXED", "");
  v1::AddTrianglesRequest rules;
  rules.set_name(name);
  rules.mutable_surface()->set_crease_angle(60);
  ExpectRefused(rules, grpc::StatusCode::FAILED_PRECONDITION, "DOMAIN_FIXED", "");
}

TEST_F(TrianglesTest, AMeshIsRefinedAgain) {
  const std::string name = CreateBlock();
  calls_.Refine(name);
  const uint64_t before = calls_.Get(name).vertex_count();
  v1::StartRefinementRequest request;
  request.set_name(name);
  request.mutable_parameters()->set_dimension(3);
  request.mutable_parameters()->mutable_surface()->set_edge_length(0.25);
  EXPECT_EQ(calls_.Refine(request).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_GT(calls_.Get(name).vertex_count(), before);
}

TEST_F(TrianglesTest, SizesByThicknessAreThoseOfTheSolid) {
  const std::string name = CreateBlock();
  v1::StartRefinementRequest request;
  request.set_name(name);
  request.mutable_parameters()->set_dimension(3);
  request.mutable_parameters()->mutable_surface()->set_thickness_layers(4);
  EXPECT_EQ(calls_.Refine(request).state(), v1::Operation::STATE_SUCCEEDED);
  const uint64_t layered = calls_.Get(name).vertex_count();
  const std::string other = CreateBlock();
  calls_.Refine(other);
  EXPECT_GT(layered, 2 * calls_.Get(other).vertex_count());
}

TEST_F(TrianglesTest, ParametersThatASurfaceDoesNotHaveAreNamed) {
  const std::string name = CreateBlock();
  v1::StartRefinementRequest request;
  request.set_name(name);
  request.mutable_parameters()->set_dimension(3);
  request.mutable_parameters()->set_criterion(v1::CRITERION_WELL_SPACED);
  calls_.Start(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.criterion");
  request.mutable_parameters()->clear_criterion();
  for (const auto& [field, set] :
       {std::pair(
            "tolerance", +[](v1::SurfaceParameters& surface) { surface.set_tolerance(0); }),
        std::pair(
            "min_facet_angle", +[](v1::SurfaceParameters& surface) { surface.set_min_facet_angle(31); }),
        std::pair(
            "edge_length", +[](v1::SurfaceParameters& surface) { surface.set_edge_length(-1); }),
        std::pair(
            "min_size", +[](v1::SurfaceParameters& surface) { surface.set_min_size(std::nan("")); }),
        std::pair(
            "outside_rho", +[](v1::SurfaceParameters& surface) { surface.set_outside_rho(1); }),
        std::pair(
            "curvature_elements", +[](v1::SurfaceParameters& surface) { surface.set_curvature_elements(0); }),
        std::pair(
            "thickness_layers", +[](v1::SurfaceParameters& surface) { surface.set_thickness_layers(-2); })}) {
    request.mutable_parameters()->clear_surface();
    set(*request.mutable_parameters()->mutable_surface());
    calls_.Start(request, &status_);
    ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", std::string("parameters.surface.") + field);
  }
}

TEST_F(TrianglesTest, WhatIsAskedOfASurfaceWantsOne) {
  const std::string name = Create();
  calls_.Upload(name, 0, BlockPoints());
  v1::StartRefinementRequest request;
  request.set_name(name);
  request.mutable_parameters()->set_dimension(3);
  request.mutable_parameters()->mutable_surface()->set_tolerance(0.1);
  calls_.Start(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.surface");
}

TEST_F(TrianglesTest, CornersOfTrianglesAreNotRemoved) {
  const std::string name = CreateBlock();
  calls_.Upload(name, kPoints, {0.1, 0.1, 0.1});
  v1::RemovePointsRequest request;
  request.set_name(name);
  request.add_points(3);
  calls_.RemovePoints(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points");
  EXPECT_THAT(status_.error_message(), HasSubstr("triangles"));
  request.set_points(0, kPoints);
  EXPECT_EQ(calls_.RemovePoints(request).committed_points(), kPoints);
}

TEST_F(TrianglesTest, ASinglePointInTheSolidIsAVertex) {
  const std::string name = CreateBlock();
  calls_.Upload(name, kPoints, {0.125, 0.25, 0.375, 9, 9, 9});
  calls_.Refine(name);
  const Download mesh = calls_.DownloadMesh(name, 0, 0, std::nullopt, /*with_boundary=*/true);
  ASSERT_TRUE(mesh.status.ok()) << mesh.status.error_message();
  EXPECT_EQ(mesh.metadata[0].statistics().surface().unmeshed_points(), 1u) << "the one outside";
  EXPECT_NEAR(mesh.metadata[0].statistics().surface().volumes(0), 1, 1e-12);
}

TEST_F(TrianglesTest, ErrorsOfTheCoreHaveReasonsOfSurfaces) {
  v1::AddTrianglesRequest block = BlockRequest("");
  block.mutable_surface()->mutable_seeds(0)->set_hole(true);
  status_ = Mesh(block).status;
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_TRIANGLES", "triangles.corners");
  EXPECT_THAT(status_.error_message(), HasSubstr("no solid is meshed"));
  block = BlockRequest("");
  block.mutable_triangles()->set_corners(4, kPoints);
  status_ = Mesh(block).status;
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_TRIANGLES", "triangles.corners");
  EXPECT_THAT(status_.error_message(), HasSubstr("triangles[1]"));
}

TEST_F(TrianglesTest, PointsCannotBeAddedToAMeshOfASurface) {
  const std::string name = CreateBlock();
  calls_.Refine(name);
  v1::AddVerticesRequest request;
  request.set_name(name);
  for (const double x : {0.1, 0.1, 0.1}) {
    request.add_points(x);
  }
  v1::AddVerticesResponse added;
  grpc::ClientContext context;
  status_ = calls_.queries().AddVertices(&context, request, &added);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST");
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY);
}

class FewTrianglesTest : public TrianglesTest {
 protected:
  FewTrianglesTest()
      : TrianglesTest([] {
          ServiceOptions options;
          options.max_points = kTriangles - 1;
          return options;
        }()) {}
};

TEST_F(FewTrianglesTest, NoMoreThanTheServerAllows) {
  EXPECT_EQ(DetailsOf(Mesh(BlockRequest("")).status).reason, "TOO_MANY_POINTS");
  ExpectRefused(BlockRequest(Create()), grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_POINTS", "");
}

}  // namespace
}  // namespace wellspace::server
