// What all calls share.
#ifndef WELLSPACE_SERVER_CALLS_CALL_ENVIRONMENT_H_
#define WELLSPACE_SERVER_CALLS_CALL_ENVIRONMENT_H_

#include <span>

#include "absl/status/statusor.h"
#include "core/mesher.h"
#include "server/base/mesh_functions.h"
#include "server/base/options.h"
#include "server/calls/call_registry.h"
#include "server/jobs/background.h"
#include "server/jobs/job_pool.h"
#include "server/jobs/memory_budget.h"
#include "server/observability/observability.h"
#include "server/security/authenticator.h"
#include "spdlog/logger.h"

namespace wellspace::server {

class RequestIds;
class SessionStore;

// What all calls share; outlives them.
struct CallEnvironment {
  const ServiceOptions& options;
  const Mesher& mesher;
  const Estimator& estimator;
  const MesherFactory& create_mesher;
  const Authenticator& authenticator;
  MemoryBudget& memory;
  JobPool& jobs;
  Background& background;
  CallRegistry& calls;
  SessionStore& sessions;
  RequestIds& request_ids;
  Observability& observability;
  spdlog::logger& log;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_CALL_ENVIRONMENT_H_
