#include "server/observability/observability.h"

#include <iterator>
#include <utility>

#include "core/base/status_macros.h"
#include "prometheus/text_serializer.h"
#include "server/network/connections.h"

namespace wellspace::server {
namespace {

// The services of the server, and the two that gRPC adds.
std::vector<std::string> AndThoseOfGrpc(std::vector<std::string> services) {
  services.insert(services.end(), {"grpc.reflection.v1alpha.ServerReflection", "grpc.channelz.v1.Channelz"});
  return services;
}

HttpAnswer MetricsAnswer(const Metrics& metrics) {
  std::vector<prometheus::MetricFamily> families;
  for (const std::shared_ptr<prometheus::Collectable>& collectable : metrics.Collectables()) {
    std::vector<prometheus::MetricFamily> some = collectable->Collect();
    std::move(some.begin(), some.end(), std::back_inserter(families));
  }
  return {.type = "text/plain; version=0.0.4; charset=utf-8", .body = prometheus::TextSerializer().Serialize(families)};
}

HttpAnswer ReadinessAnswer(Readiness readiness) {
  switch (readiness) {
    case Readiness::kReady:
      return {.body = "ready\n"};
    case Readiness::kRestoring:
      return {.status = "503 Service Unavailable", .body = "restoring sessions\n"};
    case Readiness::kStopping:
      break;
  }
  return {.status = "503 Service Unavailable", .body = "stopping\n"};
}

}  // namespace

Observability::Observability(const std::vector<std::string>& services, std::shared_ptr<spdlog::logger> log,
                             Connections& connections, CallObserver::TenantOf tenant_of)
    : log_(std::move(log)),
      call_metrics_(metrics_.registry(), AndThoseOfGrpc(services)),
      calls_(*log_, call_metrics_, connections, std::move(tenant_of)),
      work_observer_(*log_, work_) {
  metrics_.AddGauge("wellspace_calls_in_flight", "Calls that have begun and not ended.",
                    [this] { return static_cast<double>(calls_.InFlight()); });
  metrics_.AddGauge("wellspace_connections", "Connections that are open.",
                    [&connections] { return static_cast<double>(connections.Count()); });
  metrics_.AddCounter("wellspace_connections_shut_total",
                      "Connections that were shut for what their peers did with them.",
                      [&connections] { return static_cast<double>(connections.ShutCount()); });
  metrics_.AddGauge("wellspace_unclaimed_bytes",
                    "Bytes that came on open connections and are of no request that has come whole.",
                    [&connections] { return static_cast<double>(connections.UnclaimedBytes()); });
  const auto add = [this](const char* name, const char* help, const std::atomic<uint64_t>& counter) {
    metrics_.AddCounter(name, help, [&counter] { return static_cast<double>(counter.load()); });
  };
  add("wellspace_points_received_total", "Points that clients have sent.", work_.points_received);
  add("wellspace_vertices_made_total", "Vertices of finished meshes.", work_.vertices_made);
  add("wellspace_simplices_made_total", "Simplices of finished meshes.", work_.simplices_made);
  add("wellspace_cells_served_total", "Vertices that queries, for cells or neighbours, were answered for.",
      work_.cells_served);
  add("wellspace_structures_given_up_total",
      "Structures that idle sessions gave up, for other work to have the memory.", work_.structures_given_up);
}

void Observability::Watch(grpc::ServerBuilder& builder) {
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(calls_.MakeInterceptors());
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  LeaveOutChannelz(builder);
}

absl::Status Observability::Check(const ObservabilityOptions& options) {
  if (!options.metrics_listen.empty()) {
    WELLSPACE_RETURN_IF_ERROR(ParseListenAddress(options.metrics_listen).status());
  }
  return options.admin_listen.empty() ? absl::OkStatus() : AdminServer::AddressOf(options.admin_listen).status();
}

absl::Status Observability::ListenForHttp(const ObservabilityOptions& options) {
  if (options.metrics_listen.empty()) {
    return absl::OkStatus();
  }
  HttpRoutes routes;
  routes["/metrics"] = [this] { return MetricsAnswer(metrics_); };
  routes["/livez"] = [] { return HttpAnswer{.body = "alive\n"}; };
  routes["/readyz"] = [this] { return ReadinessAnswer(readiness_); };
  WELLSPACE_ASSIGN_OR_RETURN(endpoint_, HttpEndpoint::Start(options.metrics_listen, std::move(routes)));
  return absl::OkStatus();
}

absl::Status Observability::ListenForAdmin(const ObservabilityOptions& options) {
  if (!options.admin_listen.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(admin_, AdminServer::Start(options.admin_listen, calls_));
  }
  return absl::OkStatus();
}

void Observability::Stop() {
  endpoint_.reset();
  admin_.reset();
}

}  // namespace wellspace::server
