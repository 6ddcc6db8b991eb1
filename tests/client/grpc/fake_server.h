// A server of the generated services that answers as a test says.
#ifndef WELLSPACE_TESTS_CLIENT_GRPC_FAKE_SERVER_H_
#define WELLSPACE_TESTS_CLIENT_GRPC_FAKE_SERVER_H_

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "client/client.h"
#include "client/connection.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/grpcpp.h"
#include "wellspace/v1/admin.grpc.pb.h"
#include "wellspace/v1/operations.grpc.pb.h"
#include "wellspace/v1/queries.grpc.pb.h"
#include "wellspace/v1/sessions.grpc.pb.h"

namespace wellspace::client {

// An error as the server makes it; `retry_ms` >= 0 adds a RetryInfo.
inline grpc::Status MakeError(grpc::StatusCode code, const std::string& message, const std::string& reason,
                              int retry_ms = -1) {
  google::rpc::Status details;
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  details.add_details()->PackFrom(info);
  if (retry_ms >= 0) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_nanos(retry_ms * 1'000'000);
    details.add_details()->PackFrom(retry);
  }
  return grpc::Status(code, message, details.SerializeAsString());
}

// A connection that breaks, as gRPC tells it.
inline grpc::Status Broken() { return grpc::Status(grpc::StatusCode::UNAVAILABLE, "Socket closed"); }

// Patience that a test has time for.
inline RetryPolicy QuickRetries() {
  return {.max_attempts = 4,
          .max_first_attempts = 2,
          .initial_backoff = absl::Milliseconds(1),
          .multiplier = 2,
          .max_backoff = absl::Milliseconds(4)};
}

template <typename Request, typename Response>
using Unary = std::function<grpc::Status(const Request&, Response&)>;
template <typename Request, typename Response>
using Streaming = std::function<grpc::Status(grpc::ServerContext&, const Request&, grpc::ServerWriter<Response>&)>;

// The behaviour of each call; calls that a test leaves empty are UNIMPLEMENTED.
struct FakeSessions final : v1::SessionService::Service {
  Unary<v1::CreateSessionRequest, v1::CreateSessionResponse> create;
  Unary<v1::GetSessionRequest, v1::GetSessionResponse> get;
  Unary<v1::ListSessionsRequest, v1::ListSessionsResponse> list;
  Unary<v1::UpdateSessionRequest, v1::UpdateSessionResponse> update;
  Unary<v1::RemovePointsRequest, v1::RemovePointsResponse> remove_points;
  Unary<v1::DeleteSessionRequest, v1::DeleteSessionResponse> remove;
  std::function<grpc::Status(grpc::ServerContext&, grpc::ServerReader<v1::UploadPointsRequest>&,
                             v1::UploadPointsResponse&)>
      upload;
  std::function<grpc::Status(grpc::ServerContext&, grpc::ServerReader<v1::AddSegmentsRequest>&,
                             v1::AddSegmentsResponse&)>
      add_segments;
  std::function<grpc::Status(grpc::ServerContext&, grpc::ServerReader<v1::AddTrianglesRequest>&,
                             v1::AddTrianglesResponse&)>
      add_triangles;
  std::function<grpc::Status(grpc::ServerContext&, grpc::ServerReader<v1::SetSizesRequest>&, v1::SetSizesResponse&)>
      set_sizes;
  Streaming<v1::DownloadMeshRequest, v1::DownloadMeshResponse> download;

  grpc::Status CreateSession(grpc::ServerContext* /*context*/, const v1::CreateSessionRequest* request,
                             v1::CreateSessionResponse* response) override {
    return create(*request, *response);
  }
  grpc::Status GetSession(grpc::ServerContext* /*context*/, const v1::GetSessionRequest* request,
                          v1::GetSessionResponse* response) override {
    return get(*request, *response);
  }
  grpc::Status ListSessions(grpc::ServerContext* /*context*/, const v1::ListSessionsRequest* request,
                            v1::ListSessionsResponse* response) override {
    return list(*request, *response);
  }
  grpc::Status RemovePoints(grpc::ServerContext* /*context*/, const v1::RemovePointsRequest* request,
                            v1::RemovePointsResponse* response) override {
    return remove_points(*request, *response);
  }
  grpc::Status UpdateSession(grpc::ServerContext* /*context*/, const v1::UpdateSessionRequest* request,
                             v1::UpdateSessionResponse* response) override {
    return update(*request, *response);
  }
  grpc::Status DeleteSession(grpc::ServerContext* /*context*/, const v1::DeleteSessionRequest* request,
                             v1::DeleteSessionResponse* response) override {
    return remove(*request, *response);
  }
  grpc::Status UploadPoints(grpc::ServerContext* context, grpc::ServerReader<v1::UploadPointsRequest>* reader,
                            v1::UploadPointsResponse* response) override {
    return upload(*context, *reader, *response);
  }
  grpc::Status AddSegments(grpc::ServerContext* context, grpc::ServerReader<v1::AddSegmentsRequest>* reader,
                           v1::AddSegmentsResponse* response) override {
    return add_segments(*context, *reader, *response);
  }
  grpc::Status AddTriangles(grpc::ServerContext* context, grpc::ServerReader<v1::AddTrianglesRequest>* reader,
                            v1::AddTrianglesResponse* response) override {
    return add_triangles(*context, *reader, *response);
  }
  grpc::Status SetSizes(grpc::ServerContext* context, grpc::ServerReader<v1::SetSizesRequest>* reader,
                        v1::SetSizesResponse* response) override {
    return set_sizes(*context, *reader, *response);
  }
  grpc::Status DownloadMesh(grpc::ServerContext* context, const v1::DownloadMeshRequest* request,
                            grpc::ServerWriter<v1::DownloadMeshResponse>* writer) override {
    return download(*context, *request, *writer);
  }
};

struct FakeOperations final : v1::OperationService::Service {
  Unary<v1::StartRefinementRequest, v1::StartRefinementResponse> start;
  Unary<v1::GetOperationRequest, v1::GetOperationResponse> get;
  Unary<v1::ListOperationsRequest, v1::ListOperationsResponse> list;
  Unary<v1::CancelOperationRequest, v1::CancelOperationResponse> cancel;
  Streaming<v1::WatchOperationRequest, v1::WatchOperationResponse> watch;

  grpc::Status StartRefinement(grpc::ServerContext* /*context*/, const v1::StartRefinementRequest* request,
                               v1::StartRefinementResponse* response) override {
    return start(*request, *response);
  }
  grpc::Status GetOperation(grpc::ServerContext* /*context*/, const v1::GetOperationRequest* request,
                            v1::GetOperationResponse* response) override {
    return get(*request, *response);
  }
  grpc::Status ListOperations(grpc::ServerContext* /*context*/, const v1::ListOperationsRequest* request,
                              v1::ListOperationsResponse* response) override {
    return list(*request, *response);
  }
  grpc::Status CancelOperation(grpc::ServerContext* /*context*/, const v1::CancelOperationRequest* request,
                               v1::CancelOperationResponse* response) override {
    return cancel(*request, *response);
  }
  grpc::Status WatchOperation(grpc::ServerContext* context, const v1::WatchOperationRequest* request,
                              grpc::ServerWriter<v1::WatchOperationResponse>* writer) override {
    return watch(*context, *request, *writer);
  }
};

struct FakeAdmin final : v1::AdminService::Service {
  Unary<v1::ListAllOperationsRequest, v1::ListAllOperationsResponse> list;
  Unary<v1::CancelAnyOperationRequest, v1::CancelAnyOperationResponse> cancel;
  Unary<v1::DrainServerRequest, v1::DrainServerResponse> drain;
  Unary<v1::GetUsageRequest, v1::GetUsageResponse> usage;

  grpc::Status ListAllOperations(grpc::ServerContext* /*context*/, const v1::ListAllOperationsRequest* request,
                                 v1::ListAllOperationsResponse* response) override {
    return list(*request, *response);
  }
  grpc::Status CancelAnyOperation(grpc::ServerContext* /*context*/, const v1::CancelAnyOperationRequest* request,
                                  v1::CancelAnyOperationResponse* response) override {
    return cancel(*request, *response);
  }
  grpc::Status DrainServer(grpc::ServerContext* /*context*/, const v1::DrainServerRequest* request,
                           v1::DrainServerResponse* response) override {
    return drain(*request, *response);
  }
  grpc::Status GetUsage(grpc::ServerContext* /*context*/, const v1::GetUsageRequest* request,
                        v1::GetUsageResponse* response) override {
    return usage(*request, *response);
  }
};

struct FakeQueries final : v1::QueryService::Service {
  Streaming<v1::ApproximateNearestNeighborsRequest, v1::ApproximateNearestNeighborsResponse> nearest;
  Streaming<v1::ClippedVoronoiCellsRequest, v1::ClippedVoronoiCellsResponse> clipped;
  Streaming<v1::VoronoiCellsRequest, v1::VoronoiCellsResponse> cells;
  Unary<v1::LocateRequest, v1::LocateResponse> locate;
  using TransferStream = grpc::ServerReaderWriter<v1::TransferValuesResponse, v1::TransferValuesRequest>;
  std::function<grpc::Status(TransferStream& stream)> transfer;
  Unary<v1::AddVerticesRequest, v1::AddVerticesResponse> add;

  grpc::Status ApproximateNearestNeighbors(
      grpc::ServerContext* context, const v1::ApproximateNearestNeighborsRequest* request,
      grpc::ServerWriter<v1::ApproximateNearestNeighborsResponse>* writer) override {
    return nearest(*context, *request, *writer);
  }
  grpc::Status ClippedVoronoiCells(grpc::ServerContext* context, const v1::ClippedVoronoiCellsRequest* request,
                                   grpc::ServerWriter<v1::ClippedVoronoiCellsResponse>* writer) override {
    return clipped(*context, *request, *writer);
  }
  grpc::Status VoronoiCells(grpc::ServerContext* context, const v1::VoronoiCellsRequest* request,
                            grpc::ServerWriter<v1::VoronoiCellsResponse>* writer) override {
    return cells(*context, *request, *writer);
  }
  grpc::Status Locate(grpc::ServerContext* /*context*/, const v1::LocateRequest* request,
                      v1::LocateResponse* response) override {
    return locate(*request, *response);
  }
  grpc::Status TransferValues(grpc::ServerContext* /*context*/, TransferStream* stream) override {
    return transfer(*stream);
  }
  grpc::Status AddVertices(grpc::ServerContext* /*context*/, const v1::AddVerticesRequest* request,
                           v1::AddVerticesResponse* response) override {
    return add(*request, *response);
  }
};

// To be given its behaviour before the first call.
class FakeServer {
 public:
  FakeServer() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&sessions);
    builder.RegisterService(&operations);
    builder.RegisterService(&admin);
    builder.RegisterService(&queries);
    server_ = builder.BuildAndStart();
  }
  ~FakeServer() { Shutdown(); }
  FakeServer(const FakeServer&) = delete;
  FakeServer& operator=(const FakeServer&) = delete;

  // Returns when no call is being answered any more. Further calls return at once.
  void Shutdown() { server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(30)); }

  client::Client Client(const RetryPolicy& policy = QuickRetries()) {
    return client::Client(MakeConnection(server_->InProcessChannel(grpc::ChannelArguments()), policy));
  }

  // For clients in other processes.
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  FakeSessions sessions;
  FakeOperations operations;
  FakeAdmin admin;
  FakeQueries queries;

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_TESTS_CLIENT_GRPC_FAKE_SERVER_H_
