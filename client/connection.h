// What a Client talks through.
#ifndef WELLSPACE_CLIENT_CONNECTION_H_
#define WELLSPACE_CLIENT_CONNECTION_H_

#include <functional>
#include <memory>
#include <span>
#include <stop_token>

#include "absl/status/statusor.h"
#include "client/client.h"

namespace grpc {
class Channel;
}

namespace wellspace::client {

// The calls of the service in terms of the library; a test may put its own in the place of gRPC.
//
// Thread safety: implementations are thread-safe.
class Connection {
 public:
  Connection() = default;
  virtual ~Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // See Client.
  virtual absl::StatusOr<Mesh> MeshPoints(const MeshOptions& options, std::span<const double> points,
                                          const std::function<void(const Progress&)>& on_progress,
                                          std::stop_token stop) = 0;
  virtual absl::StatusOr<MeshEstimate> EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                                    std::stop_token stop) = 0;
  virtual absl::StatusOr<ServerInfo> GetServerInfo() = 0;
};

// A connection over `channel`, for example that of an embedded server.
//
// Errors of the calls: the server's code and message unchanged, its google.rpc details as payloads under their type URLs; DATA_LOSS
// when an answer contradicts itself or its checksums.
std::shared_ptr<Connection> MakeConnection(std::shared_ptr<grpc::Channel> channel);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_CONNECTION_H_
