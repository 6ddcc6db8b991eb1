// The objects that all calls share.
#ifndef WELLSPACE_SERVER_CALLS_CALL_ENVIRONMENT_H_
#define WELLSPACE_SERVER_CALLS_CALL_ENVIRONMENT_H_

#include "server/base/mesh_functions.h"
#include "server/base/options.h"
#include "server/calls/call_registry.h"
#include "server/jobs/background.h"
#include "server/jobs/blocking_threads.h"
#include "server/jobs/job_pool.h"
#include "server/jobs/memory_budget.h"
#include "server/observability/observability.h"
#include "server/security/authenticator.h"
#include "server/store/session_log.h"
#include "spdlog/logger.h"

namespace wellspace::server {

class RequestIds;
class SessionRegistry;
class UsageMeter;

// The objects that all calls share; they outlive the calls.
struct CallEnvironment {
  const ServiceOptions& options;
  const Mesher& mesher;
  const Estimator& estimator;
  const MesherFactory& create_mesher;
  const Authenticator& authenticator;
  MemoryBudget& memory;
  JobPool& jobs;
  Background& background;
  BlockingThreads& blocking;
  CallRegistry& calls;
  SessionRegistry& sessions;
  RequestIds& request_ids;
  SessionLog& session_log;
  UsageMeter& usage;
  Observability& observability;
  spdlog::logger& log;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_CALL_ENVIRONMENT_H_
