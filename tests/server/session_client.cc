#include "tests/server/session_client.h"

#include <algorithm>

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

constexpr size_t kUploadChunk = 120'000;  // numbers; a multiple of 2, 3, 4, 5 and 6

}  // namespace

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

SessionClient::SessionClient(const std::shared_ptr<grpc::Channel>& channel, const v1::MeshParameters& parameters)
    : calls_(channel), queries_(v1::QueryService::NewStub(channel)) {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = parameters;
  name_ = calls_.Create(request).name();
}

void SessionClient::Upload(const std::vector<double>& coordinates) {
  const v1::Session session = Get();
  std::vector<v1::UploadPointsRequest> requests;
  for (size_t begin = 0; begin < coordinates.size(); begin += kUploadChunk) {
    const size_t end = std::min(coordinates.size(), begin + kUploadChunk);
    requests.push_back(UploadRequest(name_, session.committed_points() + begin / session.parameters().dimension(),
                                     {coordinates.begin() + begin, coordinates.begin() + end}));
  }
  calls_.Upload(requests);
}

v1::Operation SessionClient::Refine() {
  const v1::Operation operation = calls_.Refine(name_);
  EXPECT_EQ(operation.state(), v1::Operation::STATE_SUCCEEDED) << operation.ShortDebugString();
  return operation;
}

Download SessionClient::DownloadMesh(uint64_t revision, uint64_t next_chunk, std::optional<size_t> stop_after) {
  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_name(name_);
  request.set_revision(revision);
  request.set_next_chunk(next_chunk);
  const auto stream = calls_.sessions().DownloadMesh(&context, request);
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
