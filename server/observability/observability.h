// All by which one server is watched while it runs: its log line of each call, its metrics, channelz.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_OBSERVABILITY_H_
#define WELLSPACE_SERVER_OBSERVABILITY_OBSERVABILITY_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "grpcpp/server_builder.h"
#include "server/observability/admin_server.h"
#include "server/observability/call_metrics.h"
#include "server/observability/call_observer.h"
#include "server/observability/metrics.h"
#include "server/observability/metrics_endpoint.h"
#include "server/observability/work_counters.h"
#include "server/observability/work_observer.h"
#include "spdlog/logger.h"

namespace wellspace::server {

class Connections;

// Each HOST:PORT, port 0 takes a free one; empty: not served.
struct ObservabilityOptions {
  std::string metrics_listen;  // HTTP, GET /metrics
  std::string admin_listen;    // gRPC, channelz; the loopback only
};

// Thread safety: thread-safe.
class Observability {
 public:
  // `services` are the full names of those that the server has. REQUIRES: `connections` outlives this, and this the
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

  // To be called once, when metrics() is complete. What it starts runs until Stop.
  //
  // Errors:     those of MetricsEndpoint::Start and AdminServer::Start.
  absl::Status Listen(const ObservabilityOptions& options);
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
  std::unique_ptr<MetricsEndpoint> endpoint_;
  std::unique_ptr<AdminServer> admin_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_OBSERVABILITY_H_
