// Prometheus' way to the metrics.
#ifndef WELLSPACE_SERVER_METRICS_ENDPOINT_H_
#define WELLSPACE_SERVER_METRICS_ENDPOINT_H_

#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "prometheus/exposer.h"
#include "server/metrics.h"

namespace wellspace::server {

// Serves `GET /metrics` over HTTP, on threads of its own, until it is destroyed; other paths are not found.
class MetricsEndpoint {
 public:
  // Listens on `listen`, HOST:PORT with an address or "localhost"; port 0 takes a free one. REQUIRES: `metrics` outlives this.
  //
  // Errors:     INVALID_ARGUMENT (listen), UNAVAILABLE (the address cannot be listened on).
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Start(const std::string& listen, const Metrics& metrics);

  // HOST:PORT with the port in use.
  const std::string& address() const { return address_; }

 private:
  MetricsEndpoint(std::unique_ptr<prometheus::Exposer> exposer, std::string address)
      : exposer_(std::move(exposer)), address_(std::move(address)) {}

  const std::unique_ptr<prometheus::Exposer> exposer_;
  const std::string address_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_METRICS_ENDPOINT_H_
