#include "client/grpc/grpc_connection.h"

#include <algorithm>
#include <random>
#include <utility>

#include "absl/strings/str_format.h"
#include "grpcpp/channel.h"

namespace wellspace::client {
namespace {

// Of the coordinates of one request, so that the message stays below 1 MiB.
constexpr size_t kChunkBytes = 1024 * 1024 - 1024;

}  // namespace

GrpcConnection::GrpcConnection(const std::shared_ptr<grpc::Channel>& channel, const RetryPolicy& policy,
                               OpenChannelTo open)
    : retrier_(policy), servers_(channel, std::move(open)) {}

absl::Status GrpcConnection::RunOn(const std::string& name, const CallOptions& call, const AttemptAt& attempt_at) {
  const std::string id = SessionIdOf(name);
  return retrier_.Run(call.timeout, call.stop, [&](Attempt& attempt) {
    attempt.SetSession(id);
    const std::shared_ptr<const Server> server = servers_.Of(id);
    return servers_.Follow(id, *server, attempt_at(*server, attempt), attempt);
  });
}

size_t RowsOfARequest(size_t row) { return std::max<size_t>(1, kChunkBytes / sizeof(double) / row); }

std::string RequestIdOf(const CallOptions& call) {
  if (!call.request_id.empty()) {
    return call.request_id;
  }
  std::random_device random;
  return absl::StrFormat("%08x%08x%08x%08x", random(), random(), random(), random());
}

std::shared_ptr<Connection> MakeConnection(std::shared_ptr<grpc::Channel> channel, const RetryPolicy& policy,
                                           OpenChannelTo open) {
  return std::make_shared<GrpcConnection>(channel, policy, std::move(open));
}

}  // namespace wellspace::client
