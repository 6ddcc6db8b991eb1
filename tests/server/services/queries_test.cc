// QueryService: the query structure of [HT08] Figure 3 over the network.
#include <algorithm>
#include <chrono>
#include <limits>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/services/queries/query_call.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The cells of a stream of batches, one by one.
struct Cells {
  grpc::Status status;
  size_t batches = 0;
  std::vector<core::Cell> cells;
};

template <typename Stream, typename Response>
Cells ReadCells(Stream& stream, int dimension, Response response) {
  Cells all;
  while (stream.Read(&response)) {
    ++all.batches;
    EXPECT_LE(response.ByteSizeLong(), size_t{kMaxResponseBytes});
    const v1::VoronoiCellBatch& batch = response.cells();
    const double* node = batch.nodes().data();
    const uint32_t* neighbour = batch.neighbours().data();
    for (int i = 0; i < batch.vertices_size(); ++i) {
      core::Cell& cell = all.cells.emplace_back();
      cell.vertex = batch.vertices(i);
      cell.clip_radius = batch.clip_radii(i);
      cell.is_clipped = batch.is_clipped(i);
      cell.nodes.assign(node, node + batch.node_counts(i) * dimension);
      cell.neighbours.assign(neighbour, neighbour + batch.neighbour_counts(i));
      node += cell.nodes.size();
      neighbour += cell.neighbours.size();
    }
    EXPECT_EQ(node, batch.nodes().data() + batch.nodes_size());
    EXPECT_EQ(neighbour, batch.neighbours().data() + batch.neighbours_size());
  }
  all.status = stream.Finish();
  return all;
}

Cells ClippedCells(SessionClient& client, int dimension, const std::vector<uint32_t>& vertices, double beta) {
  grpc::ClientContext context;
  v1::ClippedVoronoiCellsRequest request;
  request.set_name(client.name());
  request.mutable_vertices()->Add(vertices.begin(), vertices.end());
  request.set_beta(beta);
  return ReadCells(*client.queries().ClippedVoronoiCells(&context, request), dimension,
                   v1::ClippedVoronoiCellsResponse());
}

Cells WholeCells(SessionClient& client, int dimension, const std::vector<uint32_t>& vertices) {
  grpc::ClientContext context;
  v1::VoronoiCellsRequest request;
  request.set_name(client.name());
  request.mutable_vertices()->Add(vertices.begin(), vertices.end());
  return ReadCells(*client.queries().VoronoiCells(&context, request), dimension, v1::VoronoiCellsResponse());
}

std::vector<double> Distances(SessionClient& client, const std::vector<uint32_t>& vertices) {
  grpc::ClientContext context;
  v1::ApproximateNearestNeighborsRequest request;
  request.set_name(client.name());
  request.mutable_vertices()->Add(vertices.begin(), vertices.end());
  const auto stream = client.queries().ApproximateNearestNeighbors(&context, request);
  std::vector<double> distances;
  v1::ApproximateNearestNeighborsResponse response;
  while (stream->Read(&response)) {
    distances.insert(distances.end(), response.distances().begin(), response.distances().end());
  }
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return distances;
}

grpc::Status AddVertices(SessionClient& client, const v1::AddVerticesRequest& request,
                         v1::AddVerticesResponse* response) {
  grpc::ClientContext context;
  v1::AddVerticesRequest named = request;
  named.set_name(client.name());
  return client.queries().AddVertices(&context, named, response);
}

v1::AddVerticesRequest Points(const std::vector<double>& coordinates) {
  v1::AddVerticesRequest request;
  request.mutable_points()->Add(coordinates.begin(), coordinates.end());
  return request;
}

// The mesher of a session with the same points, in the test's own hands.
std::unique_ptr<core::Mesher> RefinedMesher(int dimension, const std::vector<double>& points) {
  core::MeshParameters parameters;
  parameters.dimension = dimension;
  parameters.domain_low.assign(dimension, 0);
  parameters.domain_high.assign(dimension, 1);
  core::RunContext context;
  auto mesher = core::Mesher::Create(parameters, points, context);
  EXPECT_TRUE(mesher.ok() && (*mesher)->Refine(parameters, context).ok());
  return *std::move(mesher);
}

void ExpectEqual(const core::Cell& cell, const core::Cell& expected) {
  EXPECT_EQ(cell.vertex, expected.vertex);
  EXPECT_EQ(cell.clip_radius, expected.clip_radius);
  EXPECT_EQ(cell.is_clipped, expected.is_clipped);
  EXPECT_EQ(cell.nodes, expected.nodes);
  EXPECT_EQ(cell.neighbours, expected.neighbours);
}

class QueriesIn : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Dimensions, QueriesIn, ::testing::Values(2, 3, 4));

TEST_P(QueriesIn, AnswerAsTheCore) {
  const int dimension = GetParam();
  const std::vector<double> points = UniformPoints(dimension == 4 ? 5 : 300, dimension, 3);
  ServiceHarness harness;
  SessionClient client(harness.channel(), UnitCubeParameters(dimension));
  client.Upload(points);
  client.Refine();
  const auto mesher = RefinedMesher(dimension, points);
  std::vector<uint32_t> all(std::min<uint64_t>(mesher->vertex_count(), 2000));
  std::iota(all.begin(), all.end(), 0);
  std::reverse(all.begin(), all.end());  // in the order of the request
  all.push_back(all.back());
  EXPECT_EQ(Distances(client, all), *mesher->NearestNeighborDistances(all));
  for (const double beta : {1.5, kInfinity}) {
    const Cells cells =
        beta == kInfinity ? WholeCells(client, dimension, all) : ClippedCells(client, dimension, all, beta);
    const std::vector<core::Cell> expected = *mesher->ClippedCells(all, beta);
    ASSERT_TRUE(cells.status.ok()) << cells.status.error_message();
    ASSERT_EQ(cells.cells.size(), expected.size());
    for (size_t i = 0; i < expected.size(); ++i) {
      ASSERT_NO_FATAL_FAILURE(ExpectEqual(cells.cells[i], expected[i]));
    }
  }
}

TEST(Queries, HundredThousandCellsComeInOneStream) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  SessionClient client(harness.channel());
  client.Upload(UniformPoints(300, 3, 4));
  client.Refine();
  const uint32_t vertex_count = static_cast<uint32_t>(client.Get().vertex_count());
  std::vector<uint32_t> vertices(100'000);
  for (uint32_t i = 0; i < vertices.size(); ++i) {
    vertices[i] = i * 7 % vertex_count;
  }
  const Cells cells = ClippedCells(client, 3, vertices, 2);
  ASSERT_TRUE(cells.status.ok()) << cells.status.error_message();
  ASSERT_EQ(cells.cells.size(), vertices.size());
  for (size_t i = 0; i < vertices.size(); ++i) {
    ASSERT_EQ(cells.cells[i].vertex, vertices[i]);
    ASSERT_GE(cells.cells[i].nodes.size(), 4u * 3);
  }
  EXPECT_GE(cells.batches, 20u);
}

TEST(Queries, NoVerticesMeanAll) {
  ServiceHarness harness;
  SessionClient client(harness.channel());
  client.Upload(UniformPoints(50, 3, 5));
  client.Refine();
  const uint64_t vertex_count = client.Get().vertex_count();
  EXPECT_EQ(Distances(client, {}).size(), vertex_count);
  const Cells cells = WholeCells(client, 3, {});
  ASSERT_EQ(cells.cells.size(), vertex_count);
  for (uint32_t i = 0; i < vertex_count; ++i) {
    EXPECT_EQ(cells.cells[i].vertex, i);
    EXPECT_EQ(cells.cells[i].clip_radius, kInfinity);
    EXPECT_FALSE(cells.cells[i].is_clipped);
  }
}

// A fake whose cells are so many that they make many batches, and so cheap that they take no time.
class ManyCells : public ::testing::Test {
 protected:
  ManyCells() {
    options_.workers = 1;
    options_.max_queued_jobs = 1;
  }

  void Begin() {
    harness_ = std::make_unique<ServiceHarness>(EndlessMesher(started_), options_, Transport::kInProcess, FakeEstimator,
                                                FixedMesher(MakeLargeMesh(6'000'000)));
    client_ = std::make_unique<SessionClient>(harness_->channel());
    client_->Refine();
    v1::VoronoiCellsRequest request;
    request.set_name(client_->name());
    stream_ = client_->queries().VoronoiCells(&context_, request);
    ASSERT_TRUE(stream_->Read(&response_));
  }

  uint64_t ReadRest() {
    uint64_t cells = response_.cells().vertices_size();
    while (stream_->Read(&response_)) {
      cells += response_.cells().vertices_size();
    }
    return cells;
  }

  ServiceOptions options_;
  Event started_;
  std::unique_ptr<ServiceHarness> harness_;
  std::unique_ptr<SessionClient> client_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::VoronoiCellsResponse>> stream_;
  v1::VoronoiCellsResponse response_;
};

TEST_F(ManyCells, OfASlowReaderTakeNoWorkerAndABoundedBuffer) {
  ASSERT_NO_FATAL_FAILURE(Begin());
  // Between two batches there is no job for a moment: it has to stay so. Should it not, the time of the test runs out.
  for (int idle = 0; idle < 50;) {
    idle = harness_->Info().running_jobs() == 0 ? idle + 1 : 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
  }
  EXPECT_LE(harness_->log().Count("batch="), 3u);  // read, being written, held by the transport
  EXPECT_EQ(ReadRest(), 1'000'000u);
  EXPECT_TRUE(stream_->Finish().ok());
}

TEST_F(ManyCells, GoOnWhenTheLineWasFull) {
  ASSERT_NO_FATAL_FAILURE(Begin());
  // Before, it would work ahead, and stand in the line itself.
  ASSERT_TRUE(harness_->log().WaitFor("batch=2"));
  harness_->TimeUntilIdle();
  TestCall running(harness_->stub());
  running.Send(UnitCubeParameters());
  running.HalfClose();
  ASSERT_TRUE(started_.Wait());
  TestCall waiting(harness_->stub());
  waiting.Send(UnitCubeParameters());
  waiting.HalfClose();
  while (harness_->Info().queued_jobs() == 0) {
    std::this_thread::yield();
  }
  std::thread canceller([&] {
    EXPECT_TRUE(harness_->log().WaitFor("the queue is full"));
    running.Cancel();
    waiting.Cancel();
  });
  EXPECT_EQ(ReadRest(), 1'000'000u);
  EXPECT_TRUE(stream_->Finish().ok());
  canceller.join();
}

TEST_F(ManyCells, EndWhenTheStructureChanges) {
  ASSERT_NO_FATAL_FAILURE(Begin());
  harness_->TimeUntilIdle();
  v1::AddVerticesResponse added;
  const grpc::Status adding = AddVertices(*client_, Points({0.5, 0.5, 0.5}), &added);
  ASSERT_TRUE(adding.ok()) << adding.error_message();
  EXPECT_LT(ReadRest(), 1'000'000u);
  const grpc::Status status = stream_->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_EQ(DetailsOf(status).reason, "REVISION_MISMATCH");
}

TEST_F(ManyCells, OfAReaderThatStopsReadingAreDropped) {
  options_.stall_limit = absl::Seconds(2);
  ASSERT_NO_FATAL_FAILURE(Begin());
  ASSERT_TRUE(harness_->log().WaitFor("code=DEADLINE_EXCEEDED"));
  ReadRest();
  EXPECT_EQ(stream_->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(ManyCells, AreCancelled) {
  ASSERT_NO_FATAL_FAILURE(Begin());
  context_.TryCancel();
  ReadRest();
  EXPECT_EQ(stream_->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(harness_->log().WaitFor("code=CANCELLED"));
  harness_->TimeUntilIdle();
}

class QueryFailsWith : public ::testing::Test {
 protected:
  ServiceHarness harness_;
  SessionClient client_{harness_.channel()};
};

TEST_F(QueryFailsWith, MeshNotReady) {
  const grpc::Status status = WholeCells(client_, 3, {}).status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(DetailsOf(status).reason, "MESH_NOT_READY");
  v1::AddVerticesResponse response;
  EXPECT_EQ(DetailsOf(AddVertices(client_, Points({0.5, 0.5, 0.5}), &response)).reason, "MESH_NOT_READY");
}

TEST_F(QueryFailsWith, VertexOutOfRange) {
  client_.Refine();
  const auto count = static_cast<uint32_t>(client_.Get().vertex_count());
  const Cells cells = ClippedCells(client_, 3, {0, count - 1, count + 5, count}, 2);
  EXPECT_EQ(cells.status.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(DetailsOf(cells.status).reason, "VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(DetailsOf(cells.status).field, "vertices[2]");
  EXPECT_THAT(cells.status.error_message(), HasSubstr(std::to_string(count + 5)));
  EXPECT_TRUE(cells.cells.empty());
}

TEST_F(QueryFailsWith, InvalidBeta) {
  client_.Refine();
  for (const double beta : {0.0, 0.99, -1.0, kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    const grpc::Status status = ClippedCells(client_, 3, {0}, beta).status;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << beta;
    EXPECT_EQ(DetailsOf(status).reason, "INVALID_REQUEST");
    EXPECT_EQ(DetailsOf(status).field, "beta");
  }
}

TEST_F(QueryFailsWith, SessionNotFound) {
  grpc::ClientContext context;
  v1::VoronoiCellsRequest request;
  request.set_name("sessions/of-another");
  const Cells cells = ReadCells(*client_.queries().VoronoiCells(&context, request), 3, v1::VoronoiCellsResponse());
  EXPECT_EQ(DetailsOf(cells.status).reason, "SESSION_NOT_FOUND");
}

TEST(QueryFails, WithQueueFullBeforeItHasBegun) {
  Event started;
  ServiceOptions options;
  options.workers = 1;
  options.max_queued_jobs = 0;
  ServiceHarness harness(EndlessMesher(started), options);
  SessionClient client(harness.channel());
  client.Refine();
  harness.TimeUntilIdle();  // an operation has ended before its worker is free
  TestCall running(harness.stub());
  running.Send(UnitCubeParameters());
  running.HalfClose();
  ASSERT_TRUE(started.Wait());
  const grpc::Status status = WholeCells(client, 3, {}).status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailsOf(status).reason, "QUEUE_FULL");
  v1::AddVerticesResponse response;
  EXPECT_EQ(DetailsOf(AddVertices(client, Points({0.5, 0.5, 0.5}), &response)).reason, "QUEUE_FULL");
}

class AddVerticesTo : public ::testing::Test {
 protected:
  AddVerticesTo() {
    client_.Upload(UniformPoints(100, 3, 6));
    client_.Refine();
  }

  ServiceHarness harness_;
  SessionClient client_{harness_.channel()};
};

TEST_F(AddVerticesTo, AReadySessionMakesItOpenAndIsRefinedLocally) {
  const v1::Session before = client_.Get();
  const std::vector<double> points = {0.31, 0.32, 0.33, 0.61, 0.62, 0.63};
  v1::AddVerticesResponse first;
  ASSERT_TRUE(AddVertices(client_, Points({points.begin(), points.begin() + 3}), &first).ok());
  v1::AddVerticesRequest near = Points({points.begin() + 3, points.end()});
  near.add_near(first.vertices(0));
  v1::AddVerticesResponse second;
  ASSERT_TRUE(AddVertices(client_, near, &second).ok());
  EXPECT_EQ(first.vertices(0), before.vertex_count());
  EXPECT_EQ(second.vertices(0), before.vertex_count() + 1);
  EXPECT_GT(first.revision(), before.revision());
  EXPECT_GT(second.revision(), first.revision());
  v1::Session open = client_.Get();
  EXPECT_EQ(open.state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(open.revision(), second.revision());
  EXPECT_EQ(open.committed_points(), before.committed_points() + 2);

  // They can be asked about before they are refined, and a point that is a vertex is that vertex.
  EXPECT_EQ(WholeCells(client_, 3, {first.vertices(0), second.vertices(0)}).cells.size(), 2u);
  v1::AddVerticesResponse again;
  ASSERT_TRUE(AddVertices(client_, Points({points.begin(), points.begin() + 3}), &again).ok());
  EXPECT_EQ(again.vertices(0), first.vertices(0));

  client_.Refine();
  const Download download = client_.DownloadMesh();
  ASSERT_TRUE(download.status.ok());
  std::vector<double> vertices;
  for (const v1::MeshChunk& chunk : download.chunks) {
    vertices.insert(vertices.end(), chunk.points().begin(), chunk.points().end());
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(vertices[3 * first.vertices(0) + k], points[k]);
    EXPECT_EQ(vertices[3 * second.vertices(0) + k], points[3 + k]);
  }
}

TEST_F(AddVerticesTo, ASessionAddsAllOrNone) {
  const v1::Session before = client_.Get();
  v1::AddVerticesResponse response;
  const grpc::Status status = AddVertices(client_, Points({0.5, 0.5, 0.5, 0.5, 1.5, 0.5}), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(DetailsOf(status).reason, "INVALID_POINTS");
  EXPECT_THAT(status.error_message(), HasSubstr("1.5"));
  const v1::Session after = client_.Get();
  EXPECT_EQ(after.revision(), before.revision());
  EXPECT_EQ(after.committed_points(), before.committed_points());
  EXPECT_EQ(after.state(), v1::Session::STATE_READY);
}

TEST_F(AddVerticesTo, ASessionOnceForEveryRequestId) {
  v1::AddVerticesRequest request = Points({0.41, 0.42, 0.43});
  request.set_request_id("once");
  v1::AddVerticesResponse first;
  v1::AddVerticesResponse second;
  ASSERT_TRUE(AddVertices(client_, request, &first).ok());
  ASSERT_TRUE(AddVertices(client_, request, &second).ok());
  EXPECT_EQ(first.SerializeAsString(), second.SerializeAsString());
  request.set_points(0, 0.5);
  EXPECT_EQ(DetailsOf(AddVertices(client_, request, &second)).reason, "REQUEST_ID_REUSED");
}

TEST_F(AddVerticesTo, ASessionAtTheExpectedRevisionOnly) {
  v1::AddVerticesRequest request = Points({0.41, 0.42, 0.43});
  request.set_expected_revision(client_.Get().revision() + 1);
  v1::AddVerticesResponse response;
  const grpc::Status status = AddVertices(client_, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_EQ(DetailsOf(status).reason, "REVISION_MISMATCH");
  request.set_expected_revision(request.expected_revision() - 1);
  EXPECT_TRUE(AddVertices(client_, request, &response).ok());
}

TEST_F(AddVerticesTo, AVertexThatDoesNotExistIsNotNear) {
  v1::AddVerticesRequest request = Points({0.41, 0.42, 0.43});
  request.add_near(static_cast<uint32_t>(client_.Get().vertex_count()));
  v1::AddVerticesResponse response;
  const grpc::Status status = AddVertices(client_, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(DetailsOf(status).reason, "VERTEX_OUT_OF_RANGE");
}

}  // namespace
}  // namespace wellspace::server
