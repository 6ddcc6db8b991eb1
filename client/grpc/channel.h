// The way to a server: plain text or TLS, with or without credentials.
#ifndef WELLSPACE_CLIENT_GRPC_CHANNEL_H_
#define WELLSPACE_CLIENT_GRPC_CHANNEL_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/connect_options.h"
#include "grpcpp/channel.h"
#include "grpcpp/support/channel_arguments.h"

namespace wellspace::client {

// A channel to HOST:PORT. Lazy: it connects with the first call. A server whose certificate cannot be trusted ends
// calls with UNAUTHENTICATED, at once. Loopback addresses are reached without a proxy, whatever the environment says;
// where one is between, the errors of connecting name it.
//
// Errors:     INVALID_ARGUMENT: the address; options that contradict each other; a file without the contents it should
//             have. FAILED_PRECONDITION: the token would leave this machine in plain text. NOT_FOUND: a file cannot be
//             read.
absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const std::string& address, const ConnectOptions& options,
                                                           const grpc::ChannelArguments& arguments);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_CHANNEL_H_
