// Sessions of domains in the plane: AddSegments, and its effects.
#include <algorithm>
#include <cmath>
#include <limits>
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

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr uint64_t kSegments = 10;
constexpr uint64_t kSeeds = 2;

class SegmentsTest : public ::testing::Test {
 protected:
  explicit SegmentsTest(const ServiceOptions& options = {})
      : harness_(core::MeshPoints, options, Transport::kInProcess, FakeEstimator, core::Mesher::Create),
        calls_(harness_.channel()) {}

  std::string Create(int dimension = 2) {
    v1::CreateSessionRequest request;
    request.mutable_parameters()->set_dimension(dimension);
    return calls_.Create(request).name();
  }
  std::string CreateFrame() {
    const std::string name = Create();
    calls_.Upload(name, 0, FramePoints());
    calls_.AddSegments({FrameRequest(name)});
    return name;
  }
  v1::StartRefinementRequest RefineTo(const std::string& name, double size) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    request.mutable_parameters()->set_dimension(2);
    request.mutable_parameters()->set_max_circumradius(size);
    return request;
  }
  v1::Operation Refine(const v1::StartRefinementRequest& request) {
    Watch watch(calls_.operations(), calls_.Start(request).name());
    EXPECT_TRUE(watch.Finish().ok());
    return watch.operation.value_or(v1::Operation());
  }
  Download DownloadMesh(const std::string& name) {
    return calls_.DownloadMesh(name, 0, 0, std::nullopt, /*with_boundary=*/true);
  }
  void ExpectError(grpc::StatusCode code, const std::string& reason, const std::string& field = "") {
    EXPECT_EQ(status_.error_code(), code) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).reason, reason) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).field, field) << status_.error_message();
  }
  // Has the session refuse `request`, and expects it to be as it was.
  void ExpectRefused(const v1::AddSegmentsRequest& request, grpc::StatusCode code, const std::string& reason,
                     const std::string& field) {
    const uint64_t revision = calls_.Get(request.name()).revision();
    calls_.AddSegments({request}, &status_);
    ExpectError(code, reason, field);
    EXPECT_EQ(calls_.Get(request.name()).revision(), revision);
  }

  ServiceHarness harness_;
  SessionCalls calls_;
  grpc::Status status_;
};

// The mesh that MeshPoints makes of the frame.
Download MeshFrame(v1::MeshingService::Stub& stub) {
  grpc::ClientContext context;
  const auto stream = stub.MeshPoints(&context);
  v1::MeshPointsRequest request;
  request.set_with_boundary(true);
  request.mutable_parameters()->set_dimension(2);
  stream->Write(request);
  for (const double x : FramePoints()) {
    request.mutable_points()->add_coordinates(x);
  }
  stream->Write(request);
  *request.mutable_segments() = FrameRequest("").segments();
  stream->Write(request);
  *request.mutable_faces() = FrameRequest("").faces();
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

TEST_F(SegmentsTest, ASessionHasTheMeshThatMeshPointsMakes) {
  const std::string name = CreateFrame();
  calls_.Refine(name);
  const Download mesh = DownloadMesh(name);
  const Download expected = MeshFrame(harness_.stub());
  ASSERT_TRUE(mesh.status.ok()) << mesh.status.error_message();
  ASSERT_TRUE(expected.status.ok()) << expected.status.error_message();
  ASSERT_EQ(mesh.metadata.size(), 1u);
  const v1::MeshMetadata& metadata = mesh.metadata[0];
  ASSERT_EQ(metadata.boundary_size(), 3);
  EXPECT_EQ(metadata.boundary(1).name(), "marker_5");
  EXPECT_EQ(metadata.boundary(2).name(), "marker_9");
  EXPECT_EQ(metadata.regions_size(), 2);
  EXPECT_GT(metadata.facet_count(), kSegments);
  EXPECT_EQ(metadata.statistics().domain().segments(), kSegments);
  ASSERT_EQ(mesh.chunks.size(), expected.chunks.size());
  for (size_t i = 0; i < mesh.chunks.size(); ++i) {
    EXPECT_EQ(mesh.chunks[i].SerializeAsString(), expected.chunks[i].SerializeAsString()) << i;
  }
}

TEST_F(SegmentsTest, TheSessionSaysWhatItHas) {
  const std::string name = Create();
  EXPECT_EQ(calls_.Get(name).faces(), v1::FACE_RULE_UNSPECIFIED) << "a cloud";
  const v1::AddSegmentsResponse added = calls_.AddSegments({FrameRequest(name)});
  EXPECT_EQ(added.segment_count(), kSegments);
  EXPECT_EQ(added.seed_count(), kSeeds);
  const v1::Session session = calls_.Get(name);
  EXPECT_EQ(session.state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(session.segment_count(), kSegments);
  EXPECT_EQ(session.seed_count(), kSeeds);
  EXPECT_EQ(session.faces(), v1::FACE_RULE_HOLES);
  EXPECT_EQ(session.crossings(), v1::CROSSING_RULE_REFUSE);
  EXPECT_EQ(session.revision(), added.revision());

  const std::string other = Create();
  v1::AddSegmentsRequest segment;
  segment.set_name(other);
  segment.mutable_segments()->add_ends(0);
  segment.mutable_segments()->add_ends(1);
  calls_.AddSegments({segment});
  EXPECT_EQ(calls_.Get(other).faces(), v1::FACE_RULE_BOX) << "the default of segments";
}

// Of a request, the segments and the seeds from a number on.
v1::AddSegmentsRequest From(const v1::AddSegmentsRequest& request, int segment, int seed) {
  v1::AddSegmentsRequest part = request;
  part.set_segment_offset(segment);
  part.set_seed_offset(seed);
  auto& ends = *part.mutable_segments()->mutable_ends();
  auto& markers = *part.mutable_segments()->mutable_markers();
  ends.erase(ends.begin(), ends.begin() + 2 * segment);
  markers.erase(markers.begin(), markers.begin() + segment);
  part.mutable_faces()->mutable_seeds()->DeleteSubrange(0, seed);
  return part;
}

TEST_F(SegmentsTest, SegmentsComeInAnyPiecesAndAreNeverTakenTwice) {
  const std::string name = Create();
  const v1::AddSegmentsRequest whole = FrameRequest(name);
  v1::AddSegmentsRequest start = whole;
  start.mutable_segments()->mutable_ends()->Truncate(6);
  start.mutable_segments()->mutable_markers()->Truncate(3);
  start.mutable_faces()->mutable_seeds()->DeleteSubrange(1, 1);
  EXPECT_EQ(calls_.AddSegments({start}).segment_count(), 3u);
  const v1::AddSegmentsResponse added = calls_.AddSegments({start, From(whole, 2, 1), From(whole, 10, 2)});
  EXPECT_EQ(added.segment_count(), kSegments);
  EXPECT_EQ(added.seed_count(), kSeeds);
  for (const v1::AddSegmentsRequest& again : {whole, start, From(whole, 9, 0)}) {
    const v1::AddSegmentsResponse repeated = calls_.AddSegments({again});
    EXPECT_EQ(repeated.segment_count(), kSegments);
    EXPECT_EQ(repeated.seed_count(), kSeeds);
    EXPECT_EQ(repeated.revision(), added.revision()) << "nothing has changed";
  }
  calls_.Upload(name, 0, FramePoints());
  calls_.Refine(name);
  EXPECT_EQ(calls_.AddSegments({whole}).segment_count(), kSegments) << "a retry may come late";
  const Download mesh = DownloadMesh(name);
  const Download expected = MeshFrame(harness_.stub());
  ASSERT_EQ(mesh.chunks.size(), expected.chunks.size());
  EXPECT_EQ(mesh.chunks.back().SerializeAsString(), expected.chunks.back().SerializeAsString());
}

TEST_F(SegmentsTest, OthersInTheSamePlaceAreRefused) {
  const std::string name = CreateFrame();
  const v1::AddSegmentsRequest whole = FrameRequest(name);
  v1::AddSegmentsRequest other = whole;
  other.mutable_segments()->set_ends(5, 7);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "segments.ends");
  EXPECT_THAT(status_.error_message(), HasSubstr("segments[2]"));
  other = From(whole, 4, 0);
  other.mutable_segments()->set_markers(3, 8);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "segments.ends");
  EXPECT_THAT(status_.error_message(), HasSubstr("segments[7]"));
  other = whole;
  other.mutable_segments()->set_open(true);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "segments.ends");
  other = whole;
  other.mutable_faces()->mutable_seeds(1)->set_region(4);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "faces.seeds");
  EXPECT_THAT(status_.error_message(), HasSubstr("seeds[1]"));
  other = whole;
  other.set_segment_offset(kSegments + 1);
  ExpectRefused(other, grpc::StatusCode::OUT_OF_RANGE, "UPLOAD_GAP", "segment_offset");
  other = From(whole, kSegments, kSeeds);
  other.set_seed_offset(kSeeds + 1);
  ExpectRefused(other, grpc::StatusCode::OUT_OF_RANGE, "UPLOAD_GAP", "seed_offset");
}

TEST_F(SegmentsTest, WhatIsNotValidIsRefusedAsAWhole) {
  const std::string name = Create();
  v1::AddSegmentsRequest bad = FrameRequest(name);
  bad.mutable_segments()->add_ends(1);
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CHUNK_SHAPE", "segments.ends");
  bad = FrameRequest(name);
  bad.mutable_segments()->add_markers(1);
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CHUNK_SHAPE", "segments.markers");
  bad = FrameRequest(name);
  bad.mutable_faces()->set_faces(static_cast<v1::FaceRule>(9));
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_SEGMENTS", "faces.faces");
  bad = FrameRequest(name);
  bad.mutable_faces()->set_crossings(static_cast<v1::CrossingRule>(9));
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_SEGMENTS", "faces.crossings");
  bad = FrameRequest(name);
  bad.mutable_faces()->mutable_seeds(1)->set_y(std::nan(""));
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_SEGMENTS", "faces.seeds");
  EXPECT_THAT(status_.error_message(), HasSubstr("seeds[1]"));
  bad = FrameRequest(name);
  bad.mutable_faces()->mutable_seeds(0)->set_max_area(0);
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_SEGMENTS", "faces.seeds");
  EXPECT_EQ(calls_.Get(name).segment_count(), 0u);

  ExpectRefused(FrameRequest(Create(3)), grpc::StatusCode::INVALID_ARGUMENT, "INVALID_SEGMENTS", "segments");
  calls_.AddSegments({}, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "EMPTY_REQUEST", "name");
  calls_.AddSegments({FrameRequest("sessions/none")}, &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
}

TEST_F(SegmentsTest, SegmentsComeBeforeTheFirstRefinement) {
  const std::string name = CreateFrame();
  calls_.Refine(name);
  v1::AddSegmentsRequest more;
  more.set_name(name);
  more.set_segment_offset(kSegments);
  more.mutable_segments()->add_ends(1);
  more.mutable_segments()->add_ends(5);
  ExpectRefused(more, grpc::StatusCode::FAILED_PRECONDITION, "DOMAIN_FIXED", "");
  EXPECT_THAT(status_.error_message(), HasSubstr("before the first refinement"));
  v1::AddSegmentsRequest rules;
  rules.set_name(name);
  rules.mutable_faces()->set_faces(v1::FACE_RULE_EVEN_ODD);
  ExpectRefused(rules, grpc::StatusCode::FAILED_PRECONDITION, "DOMAIN_FIXED", "");
  EXPECT_EQ(calls_.Get(name).faces(), v1::FACE_RULE_HOLES);
}

// The frame goes from (0, 0) on; its lower side is a segment.
TEST_F(SegmentsTest, VerticesAreAddedInFacesAndOnSegmentsAndQueriesAnswered) {
  const std::string name = CreateFrame();
  calls_.Refine(name);
  const uint64_t before = calls_.Get(name).vertex_count();
  const std::vector<double> frame = FramePoints();
  v1::AddVerticesRequest request;
  request.set_name(name);
  // On the first side, a third of the way along it.
  request.add_points(frame[0] + (frame[2] - frame[0]) / 3);
  request.add_points(frame[1] + (frame[3] - frame[1]) / 3);
  v1::AddVerticesResponse added;
  {
    grpc::ClientContext context;
    const grpc::Status status = calls_.queries().AddVertices(&context, request, &added);
    ASSERT_TRUE(status.ok()) << status.error_message();
  }
  ASSERT_EQ(added.vertices_size(), 1);
  EXPECT_EQ(added.vertices(0), before);
  calls_.Refine(name);
  const Download mesh = DownloadMesh(name);
  ASSERT_TRUE(mesh.status.ok()) << mesh.status.error_message();
  EXPECT_GT(mesh.metadata[0].vertex_count(), before);
  EXPECT_EQ(mesh.metadata[0].statistics().domain().segments(), kSegments);

  v1::ApproximateNearestNeighborsRequest question;
  question.set_name(name);
  question.add_vertices(added.vertices(0));
  grpc::ClientContext context;
  const auto stream = calls_.queries().ApproximateNearestNeighbors(&context, question);
  v1::ApproximateNearestNeighborsResponse answer;
  ASSERT_TRUE(stream->Read(&answer));
  EXPECT_TRUE(stream->Finish().ok());
  ASSERT_EQ(answer.distances_size(), 1);
  EXPECT_GT(answer.distances(0), 0);
}

TEST_F(SegmentsTest, VerticesOutsideOfWhatIsMeshedAreRefused) {
  const std::string name = CreateFrame();
  calls_.Refine(name);
  v1::AddVerticesRequest request;
  request.set_name(name);
  request.add_points(1e3);
  request.add_points(1e3);
  v1::AddVerticesResponse added;
  grpc::ClientContext context;
  status_ = calls_.queries().AddVertices(&context, request, &added);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points.coordinates");
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY);
}

TEST_F(SegmentsTest, ACallForAnotherRevisionChangesNothing) {
  const std::string name = Create();
  v1::AddSegmentsRequest request = FrameRequest(name);
  request.set_expected_revision(7);
  ExpectRefused(request, grpc::StatusCode::ABORTED, "REVISION_MISMATCH", "");
  request.set_expected_revision(1);
  v1::AddSegmentsRequest second = From(request, kSegments, kSeeds);
  second.mutable_segments()->add_ends(1);
  second.mutable_segments()->add_ends(5);
  EXPECT_EQ(calls_.AddSegments({request, second}).segment_count(), kSegments + 1) << "only the first message counts";
}

TEST_F(SegmentsTest, ParametersThatADomainDoesNotHaveAreNamed) {
  const std::string name = CreateFrame();
  v1::StartRefinementRequest request = RefineTo(name, 1);
  request.mutable_parameters()->set_criterion(v1::CRITERION_WELL_SPACED);
  calls_.Start(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.criterion");

  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  *create.mutable_parameters() = UnitCubeParameters(2);
  const std::string boxed = calls_.Create(create).name();
  calls_.AddSegments({FrameRequest(boxed)});
  calls_.Start(boxed, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.domain");
  EXPECT_EQ(calls_.Get(boxed).state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(calls_.Get(boxed).last_operation(), "");
}

TEST_F(SegmentsTest, WhatBoundsNoDomainFailsTheOperationAndOtherRulesHelp) {
  const std::string name = Create();
  calls_.Upload(name, 0, FramePoints());
  v1::AddSegmentsRequest crossed = FrameRequest(name);
  for (const uint32_t end : {4, 6, 5, 7}) {  // from corner to corner of the former hole
    crossed.mutable_segments()->add_ends(end);
  }
  crossed.mutable_segments()->mutable_markers()->Resize(12, 0);
  crossed.mutable_faces()->clear_seeds();
  calls_.AddSegments({crossed});
  const v1::Operation failed = Refine(RefineTo(name, 1));
  EXPECT_EQ(failed.state(), v1::Operation::STATE_FAILED);
  const ErrorDetails details = DetailsOf(grpc::Status(static_cast<grpc::StatusCode>(failed.error().code()),
                                                      failed.error().message(), failed.error().SerializeAsString()));
  EXPECT_EQ(details.reason, "INVALID_SEGMENTS");
  EXPECT_EQ(details.field, "segments.ends");
  v1::AddSegmentsRequest rules;
  rules.set_name(name);
  rules.mutable_faces()->set_faces(v1::FACE_RULE_HOLES);
  rules.mutable_faces()->set_crossings(v1::CROSSING_RULE_SNAP);
  calls_.AddSegments({rules});
  EXPECT_EQ(calls_.Get(name).crossings(), v1::CROSSING_RULE_SNAP);
  EXPECT_EQ(Refine(RefineTo(name, 1)).state(), v1::Operation::STATE_FAILED) << "crossings are refused still";
  rules.mutable_faces()->set_crossings(v1::CROSSING_RULE_SPLIT);
  calls_.AddSegments({rules});
  EXPECT_EQ(Refine(RefineTo(name, 1)).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(calls_.Get(name).crossings(), v1::CROSSING_RULE_SPLIT);
}

TEST_F(SegmentsTest, BoundaryRegionsAndOriginsSurviveASecondRefinement) {
  const std::string name = CreateFrame();
  calls_.Refine(name);
  const uint64_t before = DownloadMesh(name).metadata.at(0).vertex_count();
  ASSERT_EQ(Refine(RefineTo(name, 0.2)).state(), v1::Operation::STATE_SUCCEEDED);
  const Download mesh = DownloadMesh(name);
  ASSERT_TRUE(mesh.status.ok()) << mesh.status.error_message();
  const v1::MeshMetadata& metadata = mesh.metadata.at(0);
  EXPECT_GT(metadata.vertex_count(), 2 * before);
  EXPECT_EQ(metadata.boundary_size(), 3);
  EXPECT_EQ(metadata.regions_size(), 2);
  std::vector<double> points;
  std::vector<uint32_t> facets;
  std::vector<uint32_t> origins;
  std::vector<int32_t> regions;
  for (const v1::MeshChunk& chunk : mesh.chunks) {
    points.insert(points.end(), chunk.points().begin(), chunk.points().end());
    facets.insert(facets.end(), chunk.facets().begin(), chunk.facets().end());
    origins.insert(origins.end(), chunk.vertex_origins().begin(), chunk.vertex_origins().end());
    regions.insert(regions.end(), chunk.simplex_regions().begin(), chunk.simplex_regions().end());
  }
  double length = 0;
  for (size_t f = 0; f < facets.size(); f += 2) {
    length += std::hypot(points[2 * facets[f]] - points[2 * facets[f + 1]],
                         points[2 * facets[f] + 1] - points[2 * facets[f + 1] + 1]);
  }
  EXPECT_NEAR(length, 16 + 8 + 2 * std::sqrt(2), 1e-9);
  EXPECT_EQ(regions.size(), metadata.simplex_count());
  ASSERT_EQ(origins.size(), metadata.vertex_count());
  origins.resize(8);
  std::sort(origins.begin(), origins.end());
  EXPECT_THAT(origins, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

class LimitedSegmentsTest : public SegmentsTest {
 protected:
  LimitedSegmentsTest() : SegmentsTest({.max_points = 12, .max_points_per_tenant = 25}) {}
};

TEST_F(LimitedSegmentsTest, SegmentsAndSeedsAreCountedAsPointsAre) {
  const std::string name = CreateFrame();  // 8 points, 10 segments, 2 seeds
  v1::AddSegmentsRequest more;
  more.set_name(name);
  more.set_segment_offset(kSegments);
  more.mutable_segments()->mutable_ends()->Resize(6, 0);
  ExpectRefused(more, grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_POINTS", "");
  EXPECT_THAT(status_.error_message(), HasSubstr("13 segments"));
  v1::AddSegmentsRequest seeds;
  seeds.set_name(name);
  seeds.set_seed_offset(kSeeds);
  for (int i = 0; i < 11; ++i) {
    seeds.mutable_faces()->add_seeds();
  }
  ExpectRefused(seeds, grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_POINTS", "");
  EXPECT_THAT(status_.error_message(), HasSubstr("13 seeds"));

  const std::string other = Create();
  more.set_name(other);
  more.set_segment_offset(0);
  more.mutable_segments()->mutable_ends()->Resize(12, 0);
  ExpectRefused(more, grpc::StatusCode::RESOURCE_EXHAUSTED, "QUOTA_EXCEEDED", "");
  EXPECT_THAT(status_.error_message(), HasSubstr("26 points, segments, triangles and seeds"));
  calls_.Delete(name);
  EXPECT_EQ(calls_.AddSegments({more}).segment_count(), 6u) << "a deleted session has none";
}

TEST(SegmentsWhile, ARefinementIsUnderWayAreRefused) {
  Event begun;
  ServiceHarness harness(FakeMesher, {}, Transport::kInProcess, FakeEstimator,
                         ScriptedMesher(EndlessIn(core::Phase::kRefinement, [&] { begun.Set(); })));
  SessionCalls calls(harness.channel());
  const std::string name = calls.Create(2).name();
  const v1::Operation operation = calls.Start(name);
  ASSERT_TRUE(begun.Wait());
  grpc::Status status;
  calls.AddSegments({FrameRequest(name)}, &status);
  EXPECT_EQ(DetailsOf(status).reason, "SESSION_BUSY");
  calls.Cancel(operation.name());
}

}  // namespace
}  // namespace wellspace::server
