// What all calls share.
#ifndef WELLSPACE_SERVER_CALL_ENVIRONMENT_H_
#define WELLSPACE_SERVER_CALL_ENVIRONMENT_H_

#include <span>

#include "absl/status/statusor.h"
#include "core/mesher.h"
#include "server/authenticator.h"
#include "server/background.h"
#include "server/call_registry.h"
#include "server/jobs.h"
#include "server/memory_budget.h"
#include "server/mesh_functions.h"
#include "server/observability.h"
#include "server/options.h"
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

#endif  // WELLSPACE_SERVER_CALL_ENVIRONMENT_H_
