#include "client/client.h"

#include <charconv>

#include "absl/strings/str_cat.h"
#include "client/connection.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"

namespace wellspace::client {
namespace {

// Above what the server sends (chunks of at most 1 MiB).
constexpr int kMaxResponseBytes = 4 * 1024 * 1024;

// A server whose machine has vanished is noticed by pings.
constexpr int kKeepaliveMs = 20'000;
constexpr int kKeepaliveTimeoutMs = 10'000;

bool IsHostAndPort(const std::string& address) {
  const size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    return false;
  }
  uint16_t port = 0;
  const char* last = address.data() + address.size();
  const auto [end, code] = std::from_chars(address.data() + colon + 1, last, port);
  return code == std::errc() && end == last && port != 0;
}

}  // namespace

absl::StatusOr<Mesh> Client::MeshPoints(const MeshOptions& options, std::span<const double> points,
                                        const std::function<void(const Progress&)>& on_progress, std::stop_token stop) {
  return connection_->MeshPoints(options, points, on_progress, std::move(stop));
}

absl::StatusOr<MeshEstimate> Client::EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                                  std::stop_token stop) {
  return connection_->EstimateMesh(options, points, std::move(stop));
}

absl::StatusOr<ServerInfo> Client::GetServerInfo() { return connection_->GetServerInfo(); }

absl::StatusOr<Client> Connect(const std::string& address) {
  if (!IsHostAndPort(address)) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", address, "' is no address of a server; expected HOST:PORT with a port from 1 to 65535"));
  }
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxResponseBytes);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  return Client(MakeConnection(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments)));
}

}  // namespace wellspace::client
