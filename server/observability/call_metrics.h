// The metrics of calls, under the names that dashboards for gRPC know, from go-grpc-prometheus.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_CALL_METRICS_H_
#define WELLSPACE_SERVER_OBSERVABILITY_CALL_METRICS_H_

#include <array>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grpcpp/support/status_code_enum.h"
#include "prometheus/counter.h"
#include "prometheus/histogram.h"
#include "prometheus/registry.h"

namespace wellspace::server {

// grpc_server_started_total, grpc_server_handled_total, grpc_server_msg_received_total, grpc_server_msg_sent_total and
// grpc_server_handling_seconds by grpc_type, grpc_service, grpc_method and, of those handled, grpc_code.
//
// Thread safety: thread-safe.
// Invariants: the series are all there from the start, at 0; calls of methods that no service has are counted under
// "unknown", so what clients send cannot make more.
class CallMetrics {
 public:
  // The series of one method.
  struct Method {
    std::string service;  // "wellspace.v1.MeshingService"
    std::string name;     // "MeshPoints"
    bool is_known;        // false: of all methods that no service has
    prometheus::Counter* started;
    prometheus::Counter* received;  // messages
    prometheus::Counter* sent;      // messages
    prometheus::Histogram* seconds;
    std::array<prometheus::Counter*, 17> handled;  // by code

    void Handled(grpc::StatusCode code, double duration_seconds) const;
  };

  // `services` are full names, with descriptors in the generated pool of protobuf; grpc.health.v1.Health is counted,
  // too.
  //
  // REQUIRES:   `registry` outlives this.
  CallMetrics(prometheus::Registry& registry, const std::vector<std::string>& services);

  // The series of `path`, "/wellspace.v1.MeshingService/MeshPoints", or the series of unknown methods.
  const Method& Of(std::string_view path) const;

 private:
  struct Families;

  void AddMethod(const Families& families, const std::string& service, const std::string& name, bool client_streams,
                 bool server_streams);

  std::map<std::string, std::unique_ptr<Method>, std::less<>> methods_;  // by path
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_CALL_METRICS_H_
