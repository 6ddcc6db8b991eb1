// What works behind the services: workers, sessions, and all that their calls share.
#ifndef WELLSPACE_SERVER_BACKEND_H_
#define WELLSPACE_SERVER_BACKEND_H_

#include <memory>

#include "server/base/options.h"
#include "server/calls/call_environment.h"
#include "server/calls/call_registry.h"
#include "server/calls/request_ids.h"
#include "server/jobs/background.h"
#include "server/jobs/job_pool.h"
#include "server/jobs/memory_budget.h"
#include "server/observability/observability.h"
#include "server/security/authenticator.h"
#include "server/sessions/memory_session_store.h"
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
