#include "tests/server/session_client.h"

#include <random>
#include <utility>

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

class FakeSessionMesher final : public core::Mesher {
 public:
  explicit FakeSessionMesher(std::shared_ptr<const core::Mesh> mesh) : mesh_(std::move(mesh)) {}

  int dimension() const override { return mesh_->dimension; }
  uint64_t vertex_count() const override { return mesh_->vertex_count(); }
  uint64_t memory_bytes() const override { return 0; }
  absl::Status Refine(const core::MeshParameters&, core::RunContext&) override { return absl::OkStatus(); }
  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t>,
                                                      core::RunContext&) override {
    return std::vector<uint32_t>(points.size() / mesh_->dimension);
  }
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double>) override { return near; }
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const override {
    return std::vector<double>(vertices.begin(), vertices.end());
  }
  absl::StatusOr<std::vector<core::Cell>> ClippedCells(std::span<const uint32_t> vertices, double) const override {
    std::vector<core::Cell> cells(vertices.size());
    for (size_t i = 0; i < vertices.size(); ++i) {
      cells[i].vertex = vertices[i];
    }
    return cells;
  }
  absl::StatusOr<core::Mesh> Extract(int, core::RunContext&) override { return *mesh_; }
  absl::Status Update(core::Mesh& mesh, int, core::RunContext&) override {
    mesh = *mesh_;
    return absl::OkStatus();
  }
  absl::StatusOr<core::MeshEstimate> Estimate(const core::MeshParameters&, const core::RunContext&) const override {
    return core::MeshEstimate{};
  }

 private:
  const std::shared_ptr<const core::Mesh> mesh_;
};

}  // namespace

MesherFactory FakeMesherOf(core::Mesh mesh) {
  return [shared = std::make_shared<const core::Mesh>(std::move(mesh))](const core::MeshParameters&,
                                                                        std::span<const double>, core::RunContext&) {
    return absl::StatusOr<std::unique_ptr<core::Mesher>>(std::make_unique<FakeSessionMesher>(shared));
  };
}

core::Mesh MakeLargeMesh(uint64_t simplex_count) {
  core::Mesh mesh;
  mesh.dimension = 3;
  mesh.domain_low = {0, 0, 0};
  mesh.domain_high = {1, 1, 1};
  mesh.points.resize(simplex_count / 6 * 3);
  for (size_t i = 0; i < mesh.points.size(); ++i) {
    mesh.points[i] = static_cast<double>(i) / static_cast<double>(mesh.points.size());
  }
  mesh.simplices.resize(simplex_count * 4);
  for (size_t i = 0; i < mesh.simplices.size(); ++i) {
    mesh.simplices[i] = static_cast<uint32_t>(i * 2'654'435'761u) % static_cast<uint32_t>(mesh.vertex_count());
  }
  mesh.statistics.vertices = mesh.vertex_count();
  mesh.statistics.simplices = simplex_count;
  return mesh;
}

std::vector<double> RandomPoints(uint64_t seed, size_t count, int dimension) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  std::vector<double> points(count * dimension);
  for (double& coordinate : points) {
    coordinate = uniform(generator);
  }
  return points;
}

SessionClient::SessionClient(const std::shared_ptr<grpc::Channel>& channel, const v1::MeshParameters& parameters)
    : sessions_(v1::SessionService::NewStub(channel)),
      operations_(v1::OperationService::NewStub(channel)),
      queries_(v1::QueryService::NewStub(channel)) {
  grpc::ClientContext context;
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = parameters;
  v1::CreateSessionResponse response;
  const grpc::Status status = sessions_->CreateSession(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  name_ = response.session().name();
}

v1::Session SessionClient::Get() {
  grpc::ClientContext context;
  v1::GetSessionRequest request;
  request.set_name(name_);
  v1::GetSessionResponse response;
  const grpc::Status status = sessions_->GetSession(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.session();
}

void SessionClient::Upload(const std::vector<double>& coordinates) {
  constexpr size_t kChunk = 120'000;  // a multiple of 2, 3, 4, 5 and 6
  const v1::Session session = Get();
  grpc::ClientContext context;
  v1::UploadPointsResponse response;
  const auto stream = sessions_->UploadPoints(&context, &response);
  for (size_t begin = 0; begin < coordinates.size(); begin += kChunk) {
    v1::UploadPointsRequest request;
    request.set_name(name_);
    request.set_point_offset(session.committed_points() + begin / session.parameters().dimension());
    const size_t end = std::min(coordinates.size(), begin + kChunk);
    request.mutable_points()->mutable_coordinates()->Add(coordinates.begin() + begin, coordinates.begin() + end);
    if (!stream->Write(request)) {
      break;
    }
  }
  stream->WritesDone();
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

std::string SessionClient::Start() {
  grpc::ClientContext context;
  v1::StartRefinementRequest request;
  request.set_name(name_);
  v1::StartRefinementResponse response;
  const grpc::Status status = operations_->StartRefinement(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.operation().name();
}

v1::Operation SessionClient::Refine() {
  grpc::ClientContext context;
  v1::WatchOperationRequest request;
  request.set_name(Start());
  const auto stream = operations_->WatchOperation(&context, request);
  v1::WatchOperationResponse response;
  while (stream->Read(&response)) {
  }
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.operation().state(), v1::Operation::STATE_SUCCEEDED) << response.ShortDebugString();
  return response.operation();
}

Download SessionClient::DownloadMesh(uint64_t revision, uint64_t next_chunk, std::optional<size_t> stop_after) {
  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_name(name_);
  request.set_revision(revision);
  request.set_next_chunk(next_chunk);
  const auto stream = sessions_->DownloadMesh(&context, request);
  Download download;
  v1::DownloadMeshResponse response;
  while ((!stop_after.has_value() || download.chunks.size() < *stop_after) && stream->Read(&response)) {
    EXPECT_LE(response.ByteSizeLong(), size_t{kMaxResponseBytes});
    if (response.has_metadata()) {
      EXPECT_TRUE(download.chunks.empty()) << "metadata after a chunk";
      download.metadata.push_back(response.metadata());
    } else {
      download.chunks.push_back(response.chunk());
    }
  }
  if (stop_after.has_value()) {
    context.TryCancel();
  }
  download.status = stream->Finish();
  return download;
}

}  // namespace wellspace::server
