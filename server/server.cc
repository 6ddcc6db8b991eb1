#include "server/server.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <limits>

#include "core/base/status_macros.h"
#include "grpc/grpc.h"
#include "grpcpp/create_channel_posix.h"
#include "grpcpp/ext/proto_server_reflection_plugin.h"
#include "grpcpp/health_check_service_interface.h"
#include "grpcpp/resource_quota.h"
#include "grpcpp/server_builder.h"
#include "grpcpp/server_posix.h"
#include "server/base/clock.h"
#include "server/base/resources.h"
#include "server/network/compression.h"
#include "server/network/listen_address.h"
#include "server/store/session_log.h"

namespace wellspace::server {
namespace {

// Dead peers are found by pings; clients may ping as often as ours do.
constexpr int kKeepaliveMs = 30'000;
constexpr int kKeepaliveTimeoutMs = 10'000;
constexpr int kMinClientPingMs = 10'000;

// Aborted calls get this long to send their status, and idle clients to close their connections, before both are cut
// off.
constexpr std::chrono::milliseconds kFarewell(500);

// Most bytes of requests that gRPC holds, all connections together. It looks at the length of a message when all of it
// has come, from any peer; here it ends calls, one of each connection, the oldest first. Half of the limit of memory is
// as much as all messages that the budget makes room for, never so little that hundreds of clients that behave come
// near it, and never so much that strangers could take the memory that the limit leaves to others.
size_t MostReceived(const ServiceOptions& options) {
  constexpr uint64_t kMostReceivedBytes = uint64_t{1} << 30;
  return options.max_memory_bytes == 0
             ? kMostReceivedBytes
             : std::clamp(options.max_memory_bytes / 2, kLeastReceivedBytes, kMostReceivedBytes);
}

// Most bytes that are read from a connection before any is handled. gRPC would read up to 4 MiB, in which 140 000 calls
// begin and are given up, before Connections hears of the first.
constexpr int kMostReadAtOnce = 16 * 1024;

// As gRPC takes durations.
int Milliseconds(absl::Duration duration) {
  return static_cast<int>(std::min<int64_t>(absl::ToInt64Milliseconds(duration), std::numeric_limits<int>::max()));
}

// The address for others of a server that listens at `address`.
std::string AddressForOthers(ListenAddress address) {
  if (address.host == "0.0.0.0" || address.host == "::") {
    address.host = NameOfMachine();
  }
  return address.ToString();
}

// gRPC keeps these settings for the whole process.
void EnableHealthAndReflection() {
  static std::once_flag once;
  std::call_once(once, [] {
    // The last one to leave gRPC would wait up to 10 seconds for its poller of writes that did not go out at once:
    // with this reference held, none is the last.
    grpc_init();
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  });
}

}  // namespace

absl::Status Server::Check(const ServerOptions& options, std::shared_ptr<spdlog::logger> log) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<Security> security,
                             Security::Load(options.security, std::move(log)));
  if (!options.listen.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(options.listen));
    WELLSPACE_RETURN_IF_ERROR(security->CheckAddress(address));
  }
  return Observability::Check(options.observability);
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerOptions& options, std::shared_ptr<spdlog::logger> log,
                                                      std::unique_ptr<SessionLog> session_log, Mesher mesher,
                                                      Estimator estimator, MesherFactory create_mesher) {
  EnableHealthAndReflection();
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<Security> security, Security::Load(options.security, log));
  grpc::ServerBuilder builder;
  builder.SetMaxReceiveMessageSize(kMaxRequestBytes);
  builder.SetMaxSendMessageSize(kMaxSentBytes);
  RefuseCompression(builder);
  builder.SetResourceQuota(grpc::ResourceQuota("received").Resize(MostReceived(options.service)));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinClientPingMs);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, Milliseconds(options.connections.handshake_timeout));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, Milliseconds(options.connections.max_idle));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.connections.calls.max_streams);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kMostReadAtOnce);

  ListenAddress address;
  std::unique_ptr<Listener> listener;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  if (!options.listen.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(address, ParseListenAddress(options.listen));
    WELLSPACE_ASSIGN_OR_RETURN(acceptor, security->AddAcceptor(address, builder));
    WELLSPACE_ASSIGN_OR_RETURN(listener, Listener::Open(address, log));
    address.port = listener->port();
  }

  if (session_log == nullptr) {
    session_log = MakeEphemeralLog();
  }
  const bool keeps_files = session_log->is_durable();
  if (listener != nullptr) {
    WELLSPACE_RETURN_IF_ERROR(
        session_log->records().Announce(options.advertise.empty() ? AddressForOthers(address) : options.advertise));
  }
  std::unique_ptr<Server> server(new Server(options, std::move(security), std::move(log), std::move(session_log),
                                            std::move(mesher), std::move(estimator), std::move(create_mesher)));
  WELLSPACE_RETURN_IF_ERROR(server->observability_.ListenForHttp(options.observability));
  WELLSPACE_RETURN_IF_ERROR(server->backend_.Restore());
  const std::array<grpc::Service*, 5> services = {&server->meshing_, &server->sessions_, &server->operations_,
                                                  &server->queries_, &server->admin_};
  for (grpc::Service* service : services) {
    builder.RegisterService(service);
  }
  server->observability_.Watch(builder);
  server->server_ = builder.BuildAndStart();
  if (server->server_ == nullptr) {
    return absl::InternalError("gRPC cannot start a server");
  }
  for (const std::string& service : ServiceNames()) {
    server->server_->GetHealthCheckService()->SetServingStatus(service, true);
  }
  WELLSPACE_RETURN_IF_ERROR(server->observability_.ListenForAdmin(options.observability));
  if (listener != nullptr) {
    server->address_ = address.ToString();
    server->listener_ = std::move(listener);
    server->listener_->Start(std::move(acceptor), server->connections_, keeps_files);
  }
  server->observability_.SetReadiness(Readiness::kReady);
  return server;
}

Server::~Server() {
  Shutdown(absl::ZeroDuration());
  observability_.Stop();
}

ConnectionLimits Server::LimitsOf(const ServerOptions& options) {
  ConnectionLimits limits = options.connections.calls;
  limits.max_received = MostReceived(options.service);
  return limits;
}

std::vector<std::string> Server::ServiceNames() {
  return {v1::MeshingService::service_full_name(), v1::SessionService::service_full_name(),
          v1::OperationService::service_full_name(), v1::QueryService::service_full_name(),
          v1::AdminService::service_full_name()};
}

std::string Server::TenantOf(const grpc::ServerContextBase& context) const {
  const absl::StatusOr<Caller> caller = security_->authenticator().Authenticate(context);
  return caller.ok() ? caller->tenant : "";
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> Server::InProcessChannel() {
  // A pair of sockets rather than gRPC's own in-process transport, where a client's write can wait for ever when the
  // server has ended the call early.
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0) {
    return absl::ErrnoToStatus(errno, "cannot connect to the server in this process");
  }
  grpc::AddInsecureChannelFromFd(server_.get(), ends[0]);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxRequestBytes);
  // A window of one message; gRPC's grows with what is read, to many times as much as a client without a network has
  // use for.
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, kMaxResponseBytes);
  return grpc::CreateCustomInsecureChannelFromFd("in-process", ends[1], arguments);
}

void Server::Shutdown(absl::Duration grace) {
  if (server_ == nullptr) {
    return;
  }
  std::call_once(shut_down_, [this, grace] {
    observability_.SetReadiness(Readiness::kStopping);
    server_->GetHealthCheckService()->SetServingStatus(false);
    backend_.calls().Close();
    backend_.StopTakingOver();
    const absl::Duration end = SinceBoot() + grace;
    // Unwatched work gets to its end, too.
    if (!backend_.calls().WaitUntilEmpty(grace) || !backend_.jobs().WaitUntilIdle(end - SinceBoot())) {
      backend_.calls().AbortAll();
    }
    if (listener_ != nullptr) {
      listener_->Stop();
    }
    server_->Shutdown(std::chrono::system_clock::now() + kFarewell);
    server_->Wait();
  });
}

}  // namespace wellspace::server
