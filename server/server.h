// The gRPC server around the service.
#ifndef WELLSPACE_SERVER_SERVER_H_
#define WELLSPACE_SERVER_SERVER_H_

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "grpcpp/channel.h"
#include "grpcpp/server.h"
#include "server/backend.h"
#include "server/base/options.h"
#include "server/network/connections.h"
#include "server/network/listener.h"
#include "server/observability/observability.h"
#include "server/security/security.h"
#include "server/services/admin/admin_service.h"
#include "server/services/meshing/meshing_service.h"
#include "server/services/operations/operation_service.h"
#include "server/services/queries/query_service.h"
#include "server/services/sessions/session_service.h"
#include "server/store/session_log.h"
#include "spdlog/logger.h"

namespace wellspace::server {

// The limits of a connection. Durations are at least a second.
struct ConnectionOptions {
  absl::Duration handshake_timeout = absl::Seconds(20);  // from its acceptance to the first settings of HTTP/2
  absl::Duration max_idle = absl::Minutes(15);           // without any call
  ConnectionLimits calls;                                // at once
};

struct ServerOptions {
  std::string listen;     // HOST:PORT, port 0 takes a free one; empty: no listener
  std::string advertise;  // HOST:PORT by which others reach it; empty: as it listens, by the name of the machine
                          // where that is every address
  ConnectionOptions connections;
  ServiceOptions service;
  SecurityOptions security;
  ObservabilityOptions observability;
};

// Serves the services of wellspace.v1, health and reflection.
//
// Thread safety: thread-safe.
class Server {
 public:
  // Starts to serve, and goes on with what `session_log` has: sessions, and operations that have not ended. Null: an
  // MakeEphemeralLog. Tests put other work in the place of the core's.
  //
  // Errors:     INVALID_ARGUMENT (listen), those of Security::Load and AddAcceptor, of Listener::Open, of
  //             Observability::ListenForHttp and ListenForAdmin, and of Backend::Restore.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const ServerOptions& options,
                                                       std::shared_ptr<spdlog::logger> log,
                                                       std::unique_ptr<SessionLog> session_log = nullptr,
                                                       Mesher mesher = core::MeshPoints,
                                                       Estimator estimator = core::EstimateMesh,
                                                       MesherFactory create_mesher = core::Mesher::Create);

  // Whether a server could start with `options`, as far as that can be told without listening: reads tokens,
  // certificates and keys, and holds all addresses to the rules.
  //
  // Errors:     those of Start about options and files.
  static absl::Status Check(const ServerOptions& options, std::shared_ptr<spdlog::logger> log);

  // Shuts down at once.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // HOST:PORT with the port in use; empty without a listener.
  const std::string& address() const { return address_; }
  const Observability& observability() const { return observability_; }

  // A channel to this server that needs no listener. To be destroyed, with all that was made of it, before the server.
  //
  // Errors:     that of the system when the process is out of file descriptors.
  absl::StatusOr<std::shared_ptr<grpc::Channel>> InProcessChannel();

  // Not serving from now on: health says so, new calls end with UNAVAILABLE. Calls and jobs that are under way,
  // unwatched operations among them, may go on for `grace`; calls then end with UNAVAILABLE, and jobs with the server;
  // operations that a durable session log has are then the next process's.
  // Returns when all have ended, shortly after `grace` at the latest. Further calls return at once.
  //
  // REQUIRES:   grace is finite.
  void Shutdown(absl::Duration grace);

 private:
  Server(const ServerOptions& options, std::unique_ptr<Security> security, std::shared_ptr<spdlog::logger> log,
         std::unique_ptr<SessionLog> session_log, Mesher mesher, Estimator estimator, MesherFactory create_mesher)
      : security_(std::move(security)),
        connections_(LimitsOf(options), log),
        observability_(ServiceNames(), log, connections_,
                       [this](const grpc::ServerContextBase& context) { return TenantOf(context); }),
        backend_(options.service, security_->authenticator(), observability_, std::move(log), std::move(session_log),
                 std::move(mesher), std::move(estimator), std::move(create_mesher)) {}

  static ConnectionLimits LimitsOf(const ServerOptions& options);

  // Of the services that are ours.
  static std::vector<std::string> ServiceNames();

  // "" for a caller whom the authenticator refuses.
  std::string TenantOf(const grpc::ServerContextBase& context) const;

  const std::unique_ptr<const Security> security_;
  Connections connections_;
  Observability observability_;
  Backend backend_;
  MeshingService meshing_{backend_.environment()};
  SessionService sessions_{backend_.environment()};
  OperationService operations_{backend_.environment()};
  QueryService queries_{backend_.environment()};
  AdminService admin_{backend_.environment()};
  std::string address_;
  std::unique_ptr<Listener> listener_;  // null: none
  std::unique_ptr<grpc::Server> server_;
  std::once_flag shut_down_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVER_H_
