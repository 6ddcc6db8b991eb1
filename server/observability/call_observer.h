// The traces of every call: a line of the log, and the metrics of its method.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_CALL_OBSERVER_H_
#define WELLSPACE_SERVER_OBSERVABILITY_CALL_OBSERVER_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "grpcpp/server_context.h"
#include "grpcpp/support/server_interceptor.h"
#include "server/log/log_fields.h"
#include "server/observability/call_metrics.h"
#include "spdlog/logger.h"

namespace wellspace::server {

class Connections;

// Watches all calls of a server, whatever the service, from an interceptor.
//
// A call's line in the log has event=call, request_id (the value of the client's metadata `x-request-id`, if it is at
// most 64 letters, digits and ".-_", else one made here), tenant, peer, service, method, code, seconds, what its
// handler notes, traceparent (of W3C Trace Context, if the client sent one) and the message of its error. No other
// metadata and nothing of the messages is logged. The request id goes back to the client as trailing metadata
// `x-request-id`.
//
// Thread safety: thread-safe.
class CallObserver {
 public:
  // The tenant of the caller, "" if it is not known. Neither waits nor does I/O.
  using TenantOf = std::function<std::string(const grpc::ServerContextBase&)>;

  // `connections` are told of each call. REQUIRES: `log`, `metrics` and `connections` outlive this, and this the
  // server.
  CallObserver(spdlog::logger& log, const CallMetrics& metrics, Connections& connections, TenantOf tenant_of);
  ~CallObserver();

  // To be given to one server.
  std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeInterceptors();

  // Adds fields to the line of the call of `context`. A handler calls this before it ends the call.
  void Note(const grpc::ServerContextBase* context, const LogFields& fields);

  // Calls that are under way.
  size_t InFlight() const;

 private:
  class Interceptor;
  class Factory;

  void Add(const grpc::ServerContextBase* context, Interceptor* call);
  void Remove(const grpc::ServerContextBase* context);
  std::string MakeRequestId();

  spdlog::logger& log_;
  const CallMetrics& metrics_;
  Connections& connections_;
  const TenantOf tenant_of_;
  const std::string request_id_prefix_;
  std::atomic<uint64_t> next_request_{1};
  mutable std::mutex mutex_;
  std::unordered_map<const grpc::ServerContextBase*, Interceptor*> calls_;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_CALL_OBSERVER_H_
