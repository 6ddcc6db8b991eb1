// A look at the server's own sockets and calls, for its operator.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_ADMIN_SERVER_H_
#define WELLSPACE_SERVER_OBSERVABILITY_ADMIN_SERVER_H_

#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "grpcpp/server.h"
#include "grpcpp/server_builder.h"
#include "server/network/listen_address.h"
#include "server/observability/call_observer.h"

namespace wellspace::server {

// Channelz shows the addresses and certificates of all peers: it has a listener of its own, on the loopback. gRPC adds
// channelz to every server of the process, so servers for users are to be built without it.
void LeaveOutChannelz(grpc::ServerBuilder& builder);

// Serves grpc.channelz.v1 for all gRPC servers and channels of the process, health and reflection, in plain text and to
// all that can connect, until it is destroyed.
class AdminServer {
 public:
  // The address in `listen`, HOST:PORT.
  //
  // Errors:     INVALID_ARGUMENT (listen), FAILED_PRECONDITION (not the loopback).
  static absl::StatusOr<ListenAddress> AddressOf(const std::string& listen);

  // Listens on `listen`, HOST:PORT on the loopback; port 0 takes a free one. REQUIRES: `observer` outlives this.
  //
  // Errors:     INVALID_ARGUMENT (listen), FAILED_PRECONDITION (not the loopback), UNAVAILABLE (the address cannot be
  //             listened on).
  static absl::StatusOr<std::unique_ptr<AdminServer>> Start(const std::string& listen, CallObserver& observer);

  ~AdminServer();
  AdminServer(const AdminServer&) = delete;
  AdminServer& operator=(const AdminServer&) = delete;

  // HOST:PORT with the port in use.
  const std::string& address() const { return address_; }

 private:
  AdminServer(std::unique_ptr<grpc::Server> server, std::string address)
      : server_(std::move(server)), address_(std::move(address)) {}

  const std::unique_ptr<grpc::Server> server_;
  const std::string address_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_ADMIN_SERVER_H_
