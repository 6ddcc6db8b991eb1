// All by which one server is watched while it runs: its log line of each call, its metrics, channelz.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_OBSERVABILITY_H_
#define WELLSPACE_SERVER_OBSERVABILITY_OBSERVABILITY_H_

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "grpcpp/server_builder.h"
#include "server/network/http_endpoint.h"
#include "server/observability/admin_server.h"
#include "server/observability/call_metrics.h"
#include "server/observability/call_observer.h"
#include "server/observability/metrics.h"
#include "server/observability/work_counters.h"
#include "server/observability/work_observer.h"
#include "spdlog/logger.h"

namespace wellspace::server {

class Connections;

// Each HOST:PORT, port 0 takes a free one; empty: not served.
struct ObservabilityOptions {
  std::string metrics_listen;  // HTTP: /metrics, /livez, /readyz
  std::string admin_listen;    // gRPC, channelz; the loopback only
};

// Whether a server takes calls; the answer of /readyz.
enum class Readiness { kRestoring, kReady, kStopping };

// Thread safety: thread-safe.
class Observability {
 public:
  // `services` are the full names of the server's services. REQUIRES: `connections` outlives this, and this the
  // server.
  Observability(const std::vector<std::string>& services, std::shared_ptr<spdlog::logger> log, Connections& connections,
                CallObserver::TenantOf tenant_of);

  CallObserver& calls() { return calls_; }
  WorkObserver& work() { return work_observer_; }
  // For what else is to be read.
  Metrics& metrics() { return metrics_; }
  const Metrics& metrics() const { return metrics_; }

  // Has the server of `builder` watched, and serve no channelz to its users.
  void Watch(grpc::ServerBuilder& builder);

  // Holds the addresses of `options` to the rules, without listening.
  //
  // Errors:     those of ListenForHttp and ListenForAdmin about the text of an address.
  static absl::Status Check(const ObservabilityOptions& options);

  // Serves /metrics, /livez and /readyz. To be called once, when metrics() is complete; runs until Stop. It may be
  // called while sessions are restored, so that probes see a server that is alive and not ready.
  //
  // Errors:     as of HttpEndpoint::Start.
  absl::Status ListenForHttp(const ObservabilityOptions& options);

  // Serves channelz. To be called once, after the server has been started; runs until Stop.
  //
  // Errors:     as of AdminServer::Start.
  absl::Status ListenForAdmin(const ObservabilityOptions& options);

  // Sets the answer of /readyz. A server begins with kRestoring.
  void SetReadiness(Readiness readiness) { readiness_ = readiness; }

  // HOST:PORT with the port in use; empty: not served.
  std::string metrics_address() const { return endpoint_ == nullptr ? "" : endpoint_->address(); }
  std::string admin_address() const { return admin_ == nullptr ? "" : admin_->address(); }

  // Nothing is read from now on. To be called, not from several threads at once, before what metrics() reads is
  // destroyed.
  void Stop();

 private:
  const std::shared_ptr<spdlog::logger> log_;
  Metrics metrics_;
  CallMetrics call_metrics_;
  CallObserver calls_;
  WorkCounters work_;
  WorkObserver work_observer_;
  std::atomic<Readiness> readiness_ = Readiness::kRestoring;
  std::unique_ptr<HttpEndpoint> endpoint_;
  std::unique_ptr<AdminServer> admin_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_OBSERVABILITY_H_
