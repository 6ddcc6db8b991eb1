// What works behind the services: workers, sessions, and all that their calls share.
#ifndef WELLSPACE_SERVER_BACKEND_H_
#define WELLSPACE_SERVER_BACKEND_H_

#include <memory>

#include "server/authenticator.h"
#include "server/background.h"
#include "server/call_environment.h"
#include "server/call_registry.h"
#include "server/jobs.h"
#include "server/memory_budget.h"
#include "server/memory_session_store.h"
#include "server/observability.h"
#include "server/options.h"
#include "server/request_ids.h"
#include "spdlog/logger.h"

namespace wellspace::server {

// Owns what a CallEnvironment names, and deletes sessions whose lease has run out.
//
// Thread safety: thread-safe.
// REQUIRES:   the gRPC server has ended all calls before this is destroyed.
class Backend {
 public:
  // `authenticator` outlives this; `observability` too, but reads nothing any more when this is destroyed.
  Backend(const ServiceOptions& options, const Authenticator& authenticator, Observability& observability,
          std::shared_ptr<spdlog::logger> log, Mesher mesher, Estimator estimator, MesherFactory create_mesher);

  const CallEnvironment& environment() const { return environment_; }
  CallRegistry& calls() { return calls_; }
  JobPool& jobs() { return jobs_; }

 private:
  void ScheduleExpiry();
  void AddMetrics(Metrics& metrics);

  const ServiceOptions options_;
  const std::shared_ptr<spdlog::logger> log_;
  const Mesher mesher_;
  const Estimator estimator_;
  const MesherFactory create_mesher_;
  CallRegistry calls_;
  RequestIds request_ids_;
  MemoryBudget memory_;
  MemorySessionStore sessions_;
  const CallEnvironment environment_;
  // Jobs end before the background thread, to which they post; both end before what they work on.
  Background background_;
  JobPool jobs_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BACKEND_H_
