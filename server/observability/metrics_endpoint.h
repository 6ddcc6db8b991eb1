// Prometheus' way to the metrics.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_METRICS_ENDPOINT_H_
#define WELLSPACE_SERVER_OBSERVABILITY_METRICS_ENDPOINT_H_

#include <chrono>
#include <cstddef>
#include <list>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "server/base/file_descriptor.h"
#include "server/observability/metrics.h"

namespace wellspace::server {

// Serves `GET /metrics` over HTTP, on a thread of its own, until it is destroyed; other paths are not found.
//
// No client waits for another: all connections are served at once, each for kTimeout at most, and when there are
// kMostClients the oldest goes. An HTTP server with a thread for each client was rejected: a few requests that never
// come whole hold all.
class MetricsEndpoint {
 public:
  static constexpr size_t kMostClients = 64;
  static constexpr size_t kMostRequestBytes = 8192;
  static constexpr std::chrono::seconds kTimeout{5};

  // Listens on `listen`, HOST:PORT with an address or "localhost"; port 0 takes a free one. REQUIRES: `metrics`
  // outlives this.
  //
  // Errors:     INVALID_ARGUMENT (listen), UNAVAILABLE (the address cannot be listened on).
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Start(const std::string& listen, const Metrics& metrics);
  ~MetricsEndpoint();
  MetricsEndpoint(const MetricsEndpoint&) = delete;
  MetricsEndpoint& operator=(const MetricsEndpoint&) = delete;

  // HOST:PORT with the port in use.
  const std::string& address() const { return address_; }

 private:
  struct Client;

  MetricsEndpoint(std::vector<FileDescriptor> sockets, std::string address, const Metrics& metrics);

  void Run();
  void Accept(int socket);
  // Reads and writes what can be; false when the client is done with.
  bool Serve(Client& client) const;
  std::string AnswerTo(const std::string& request) const;

  const std::vector<FileDescriptor> sockets_;
  const std::string address_;
  const Metrics& metrics_;
  const FileDescriptor stop_;  // readable when the thread is to end
  std::list<Client> clients_;  // the thread's, the oldest first
  std::thread thread_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_METRICS_ENDPOINT_H_
