// A Client over a channel of gRPC.
#include <memory>
#include <string>
#include <utility>

#include "client/client.h"
#include "client/connection.h"
#include "client/grpc/channel.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

// Above the largest message of a server (chunks of at most 1 MiB).
constexpr int kMaxResponseBytes = 4 * 1024 * 1024;

// A server whose machine has vanished is noticed by pings.
constexpr int kKeepaliveMs = 20'000;
constexpr int kKeepaliveTimeoutMs = 10'000;

// The delay of the first attempt after a lost connection, and the largest delay of a later one.
constexpr int kInitialReconnectMs = 200;
constexpr int kMaxReconnectMs = 5'000;

}  // namespace

absl::StatusOr<Client> Connect(const std::string& address, const ConnectOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxResponseBytes);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kInitialReconnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxReconnectMs);
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<grpc::Channel> channel, OpenChannel(address, options, arguments));
  return Client(MakeConnection(std::move(channel)));
}

}  // namespace wellspace::client
