#include "client/grpc/grpc_connection.h"

#include <algorithm>
#include <random>

#include "absl/strings/str_format.h"
#include "grpcpp/channel.h"

namespace wellspace::client {
namespace {

// Of the coordinates of one request, so that the message stays below 1 MiB.
constexpr size_t kChunkBytes = 1024 * 1024 - 1024;

}  // namespace

GrpcConnection::GrpcConnection(const std::shared_ptr<grpc::Channel>& channel, const RetryPolicy& policy)
    : retrier_(policy),
      meshing_(v1::MeshingService::NewStub(channel)),
      sessions_(v1::SessionService::NewStub(channel)),
      operations_(v1::OperationService::NewStub(channel)),
      queries_(v1::QueryService::NewStub(channel)),
      health_(grpc::health::v1::Health::NewStub(channel)) {}

size_t RowsOfARequest(size_t row) { return std::max<size_t>(1, kChunkBytes / sizeof(double) / row); }

std::string RequestIdOf(const CallOptions& call) {
  if (!call.request_id.empty()) {
    return call.request_id;
  }
  std::random_device random;
  return absl::StrFormat("%08x%08x%08x%08x", random(), random(), random(), random());
}

std::shared_ptr<Connection> MakeConnection(std::shared_ptr<grpc::Channel> channel, const RetryPolicy& policy) {
  return std::make_shared<GrpcConnection>(channel, policy);
}

}  // namespace wellspace::client
