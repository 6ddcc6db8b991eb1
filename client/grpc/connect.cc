// A Client over a channel of gRPC.
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "client/address.h"
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

// A channel to the server that another one has named. `is_local`: the connection was made to this machine's loopback.
absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenNamed(const std::string& named, bool is_local,
                                                         const ConnectOptions& options,
                                                         const grpc::ChannelArguments& arguments) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string host, HostOfNamed(named));
  if (IsLoopback(host) && !is_local) {
    return absl::FailedPreconditionError(
        "that is the loopback, which is another one on this machine; its --advertise wants an address by which clients "
        "reach it");
  }
  return OpenChannel(named, options, arguments);
}

}  // namespace

absl::StatusOr<Client> Connect(const std::string& address, const ConnectOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxResponseBytes);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kInitialReconnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxReconnectMs);
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<grpc::Channel> channel, OpenChannel(address, options, arguments));
  OpenChannelTo open;
  if (options.follow) {
    open = [options, arguments, is_local = IsLoopback(*HostOf(address))](const std::string& named) {
      return OpenNamed(named, is_local, options, arguments);
    };
  }
  return Client(MakeConnection(std::move(channel), {}, std::move(open)));
}

}  // namespace wellspace::client
