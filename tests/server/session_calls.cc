#include "tests/server/session_calls.h"

#include <algorithm>
#include <random>

#include "absl/time/clock.h"
#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

constexpr size_t kUploadChunk = 120'000;  // numbers; a multiple of 2, 3, 4, 5 and 6

template <typename Stub, typename Request, typename Response>
Response Call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
              const Request& request, grpc::Status* status) {
  grpc::ClientContext context;
  Response response;
  const grpc::Status ended = (stub.*method)(&context, request, &response);
  if (status != nullptr) {
    *status = ended;
  } else {
    EXPECT_TRUE(ended.ok()) << ended.error_message();
  }
  return response;
}

}  // namespace

Watch::Watch(v1::OperationService::Stub& stub, const std::string& name, std::optional<uint64_t> after,
             std::optional<absl::Duration> timeout) {
  if (timeout.has_value()) {
    context_.set_deadline(absl::ToChronoTime(absl::Now() + *timeout));
  }
  v1::WatchOperationRequest request;
  request.set_name(name);
  if (after.has_value()) {
    request.set_after_sequence(*after);
  }
  stream_ = stub.WatchOperation(&context_, request);
}

Watch::~Watch() {
  if (!finished_) {
    Cancel();
    Finish();
  }
}

bool Watch::Read() {
  v1::WatchOperationResponse response;
  if (!stream_->Read(&response)) {
    return false;
  }
  EXPECT_FALSE(operation.has_value()) << "something after the operation's end";
  if (response.has_progress()) {
    events.push_back(response.progress());
    times.push_back(absl::Now());
  } else {
    operation = response.operation();
  }
  return true;
}

bool Watch::ReadUntil(v1::Phase phase) {
  while (events.empty() || PlaceOf(events.back().phase()) < PlaceOf(phase)) {
    if (!Read()) {
      return false;
    }
  }
  return true;
}

grpc::Status Watch::Finish() {
  while (Read()) {
  }
  finished_ = true;
  return stream_->Finish();
}

SessionCalls::SessionCalls(const std::shared_ptr<grpc::Channel>& channel)
    : sessions_(v1::SessionService::NewStub(channel)),
      operations_(v1::OperationService::NewStub(channel)),
      queries_(v1::QueryService::NewStub(channel)) {}

v1::Session SessionCalls::Create(const v1::CreateSessionRequest& request, grpc::Status* status) {
  return Call(*sessions_, &v1::SessionService::Stub::CreateSession, request, status).session();
}

v1::Session SessionCalls::Create(int dimension) {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(dimension);
  return Create(request);
}

v1::Session SessionCalls::Get(const std::string& name, grpc::Status* status) {
  v1::GetSessionRequest request;
  request.set_name(name);
  return Call(*sessions_, &v1::SessionService::Stub::GetSession, request, status).session();
}

v1::ListSessionsResponse SessionCalls::List(const v1::ListSessionsRequest& request, grpc::Status* status) {
  return Call(*sessions_, &v1::SessionService::Stub::ListSessions, request, status);
}

v1::RemovePointsResponse SessionCalls::RemovePoints(const v1::RemovePointsRequest& request, grpc::Status* status) {
  return Call(*sessions_, &v1::SessionService::Stub::RemovePoints, request, status);
}

v1::Session SessionCalls::Update(const v1::UpdateSessionRequest& request, grpc::Status* status) {
  return Call(*sessions_, &v1::SessionService::Stub::UpdateSession, request, status).session();
}

void SessionCalls::Delete(const v1::DeleteSessionRequest& request, grpc::Status* status) {
  Call(*sessions_, &v1::SessionService::Stub::DeleteSession, request, status);
}

void SessionCalls::Delete(const std::string& name, grpc::Status* status) {
  v1::DeleteSessionRequest request;
  request.set_name(name);
  Delete(request, status);
}

namespace {

// Sends `requests`, and ends the call: with `status`, or as a success.
template <typename Request>
void SendAll(grpc::ClientWriter<Request>& stream, const std::vector<Request>& requests, grpc::Status* status) {
  for (const Request& request : requests) {
    stream.Write(request);
  }
  stream.WritesDone();
  const grpc::Status ended = stream.Finish();
  if (status != nullptr) {
    *status = ended;
  } else {
    EXPECT_TRUE(ended.ok()) << ended.error_message();
  }
}

}  // namespace

v1::UploadPointsResponse SessionCalls::Upload(const std::vector<v1::UploadPointsRequest>& requests,
                                              grpc::Status* status) {
  grpc::ClientContext context;
  v1::UploadPointsResponse response;
  const auto stream = sessions_->UploadPoints(&context, &response);
  SendAll(*stream, requests, status);
  return response;
}

v1::UploadPointsResponse SessionCalls::Upload(const std::string& name, uint64_t offset,
                                              const std::vector<double>& coordinates, grpc::Status* status) {
  return Upload({UploadRequest(name, offset, coordinates)}, status);
}

v1::AddSegmentsResponse SessionCalls::AddSegments(const std::vector<v1::AddSegmentsRequest>& requests,
                                                  grpc::Status* status) {
  grpc::ClientContext context;
  v1::AddSegmentsResponse response;
  const auto stream = sessions_->AddSegments(&context, &response);
  SendAll(*stream, requests, status);
  return response;
}

v1::AddTrianglesResponse SessionCalls::AddTriangles(const std::vector<v1::AddTrianglesRequest>& requests,
                                                    grpc::Status* status) {
  grpc::ClientContext context;
  v1::AddTrianglesResponse response;
  const auto stream = sessions_->AddTriangles(&context, &response);
  SendAll(*stream, requests, status);
  return response;
}

v1::SetSizesResponse SessionCalls::SetSizes(const std::vector<v1::SetSizesRequest>& requests, grpc::Status* status) {
  grpc::ClientContext context;
  v1::SetSizesResponse response;
  const auto stream = sessions_->SetSizes(&context, &response);
  SendAll(*stream, requests, status);
  return response;
}

v1::Operation SessionCalls::Start(const v1::StartRefinementRequest& request, grpc::Status* status) {
  return Call(*operations_, &v1::OperationService::Stub::StartRefinement, request, status).operation();
}

v1::Operation SessionCalls::Start(const std::string& name, grpc::Status* status) {
  v1::StartRefinementRequest request;
  request.set_name(name);
  return Start(request, status);
}

v1::Operation SessionCalls::GetOperation(const std::string& name, grpc::Status* status) {
  v1::GetOperationRequest request;
  request.set_name(name);
  return Call(*operations_, &v1::OperationService::Stub::GetOperation, request, status).operation();
}

v1::ListOperationsResponse SessionCalls::ListOperations(const v1::ListOperationsRequest& request,
                                                        grpc::Status* status) {
  return Call(*operations_, &v1::OperationService::Stub::ListOperations, request, status);
}

v1::Operation SessionCalls::Cancel(const std::string& name, grpc::Status* status) {
  v1::CancelOperationRequest request;
  request.set_name(name);
  return Call(*operations_, &v1::OperationService::Stub::CancelOperation, request, status).operation();
}

v1::Operation SessionCalls::Refine(const std::string& name) {
  v1::StartRefinementRequest request;
  request.set_name(name);
  return Refine(request);
}

v1::Operation SessionCalls::Refine(const v1::StartRefinementRequest& request) {
  Watch watch(*operations_, Start(request).name());
  const grpc::Status status = watch.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return watch.operation.value_or(v1::Operation());
}

Download SessionCalls::DownloadMesh(const std::string& name, uint64_t revision, uint64_t next_chunk,
                                    std::optional<size_t> stop_after, bool with_boundary) {
  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_with_boundary(with_boundary);
  request.set_name(name);
  if (revision != 0) {
    request.set_revision(revision);
  }
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

Download SessionCalls::DownloadMesh(const v1::DownloadMeshRequest& request) {
  grpc::ClientContext context;
  const auto stream = sessions_->DownloadMesh(&context, request);
  Download download;
  v1::DownloadMeshResponse response;
  while (stream->Read(&response)) {
    EXPECT_LE(response.ByteSizeLong(), size_t{kMaxResponseBytes});
    if (response.has_metadata()) {
      download.metadata.push_back(response.metadata());
    } else if (response.has_chunk()) {
      download.chunks.push_back(response.chunk());
    } else {
      download.deltas.push_back(response.delta());
    }
  }
  download.status = stream->Finish();
  return download;
}

std::string SessionCalls::MeshBytes(const std::string& name) {
  const Download download = DownloadMesh(name, 0, 0, std::nullopt, true);
  EXPECT_TRUE(download.status.ok()) << download.status.error_message();
  std::string bytes;
  for (const v1::MeshChunk& chunk : download.chunks) {
    bytes += chunk.SerializeAsString();
  }
  return bytes;
}

v1::SetSizesRequest SizesRequest(const std::string& name, const std::vector<double>& points,
                                 const std::vector<double>& sizes) {
  v1::SetSizesRequest request;
  request.set_name(name);
  request.mutable_samples()->mutable_points()->Assign(points.begin(), points.end());
  request.mutable_samples()->mutable_sizes()->Assign(sizes.begin(), sizes.end());
  return request;
}

std::vector<double> FramePoints() { return {0, 0, 4, 0, 4, 4, 0, 4, 1, 1, 3, 1, 3, 3, 1, 3}; }

v1::AddSegmentsRequest FrameRequest(const std::string& name) {
  v1::AddSegmentsRequest request;
  request.set_name(name);
  for (const uint32_t end : {0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4, 0, 4, 2, 6}) {
    request.mutable_segments()->add_ends(end);
  }
  for (const int32_t marker : {5, 5, 5, 5, 9, 9, 9, 9, 0, 0}) {
    request.mutable_segments()->add_markers(marker);
  }
  request.mutable_faces()->set_faces(v1::FACE_RULE_HOLES);
  v1::FaceSeed& hole = *request.mutable_faces()->add_seeds();
  hole.set_x(2);
  hole.set_y(2);
  hole.set_hole(true);
  v1::FaceSeed& region = *request.mutable_faces()->add_seeds();
  region.set_x(0.5);
  region.set_y(2);
  region.set_region(3);
  return request;
}

std::vector<double> BlockPoints() {
  std::vector<double> points;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back((corner >> axis & 1) - 0.5);
    }
  }
  return points;
}

v1::AddTrianglesRequest BlockRequest(const std::string& name) {
  // The corners of each side, counterclockwise from outside; corner c has the bits of its coordinates.
  constexpr uint32_t kSides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  v1::AddTrianglesRequest request;
  request.set_name(name);
  v1::TriangleChunk& triangles = *request.mutable_triangles();
  int32_t marker = 0;
  for (const auto& side : kSides) {
    for (const uint32_t corner : {side[0], side[1], side[2], side[0], side[2], side[3]}) {
      triangles.add_corners(corner);
    }
    ++marker;
    triangles.add_markers(marker);
    triangles.add_markers(marker);
  }
  v1::SurfaceOptions& surface = *request.mutable_surface();
  surface.set_solids(v1::SOLID_RULE_HOLES);
  v1::SolidSeed& region = *surface.add_seeds();
  region.set_x(0.25);
  region.set_region(4);
  return request;
}

SessionClient::SessionClient(const std::shared_ptr<grpc::Channel>& channel, const v1::MeshParameters& parameters)
    : calls_(channel) {
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

v1::UploadPointsRequest UploadRequest(const std::string& name, uint64_t offset,
                                      const std::vector<double>& coordinates) {
  v1::UploadPointsRequest request;
  request.set_name(name);
  request.set_point_offset(offset);
  request.mutable_points()->mutable_coordinates()->Assign(coordinates.begin(), coordinates.end());
  return request;
}

std::vector<double> UniformPoints(size_t count, int dimension, uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  std::vector<double> points(count * dimension);
  for (double& coordinate : points) {
    coordinate = uniform(generator);
  }
  return points;
}

}  // namespace wellspace::server
