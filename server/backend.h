// The backend of the services: workers, sessions, and all that their calls share.
#ifndef WELLSPACE_SERVER_BACKEND_H_
#define WELLSPACE_SERVER_BACKEND_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/base/clock.h"
#include "server/base/options.h"
#include "server/calls/call_environment.h"
#include "server/calls/call_registry.h"
#include "server/calls/request_ids.h"
#include "server/jobs/background.h"
#include "server/jobs/blocking_threads.h"
#include "server/jobs/job_pool.h"
#include "server/jobs/memory_budget.h"
#include "server/jobs/run_by.h"
#include "server/observability/observability.h"
#include "server/security/authenticator.h"
#include "server/sessions/idle_sessions.h"
#include "server/sessions/other_owners.h"
#include "server/sessions/refinement.h"
#include "server/sessions/session_registry.h"
#include "server/sessions/work_offers.h"
#include "server/store/session_log.h"
#include "server/store/usage_meter.h"
#include "spdlog/logger.h"

namespace wellspace::server {

// The clock, the threads and the names that a Backend works with. Tests decide what time it is, and what runs when.
struct BackendDrive {
  Clock clock{};
  RunBy run_by = RunBy::kOwnThreads;
  std::function<std::string()> make_session_name = UnguessableSessionName;
};

// Owns the parts that a CallEnvironment names, and deletes sessions whose lease has run out.
//
// Thread safety: thread-safe.
// REQUIRES:   the gRPC server has ended all calls before this is destroyed.
class Backend {
 public:
  // `authenticator` outlives this; `observability` too, but reads nothing any more when this is destroyed.
  Backend(const ServiceOptions& options, const Authenticator& authenticator, Observability& observability,
          std::shared_ptr<spdlog::logger> log, std::unique_ptr<SessionLog> session_log, Mesher mesher,
          Estimator estimator, MesherFactory create_mesher, const BackendDrive& drive = {});

  // Takes over the contents of the session log: sessions, answers, and operations that have not ended, whose work
  // begins. To be called once, before any call is served.
  //
  // Errors:     as of Records::Load and Apply.
  absl::Status Restore();

  // Takes nothing over from other servers any more.
  void StopTakingOver() { other_owners_.Stop(); }

  // Operations whose work has not ended are the next process's, if the session log is durable.
  ~Backend();

  const CallEnvironment& environment() const { return environment_; }
  CallRegistry& calls() { return calls_; }
  JobPool& jobs() { return jobs_; }
  Background& background() { return background_; }
  BlockingThreads& blocking() { return blocking_; }

 private:
  void ScheduleExpiry();
  void ScheduleOffers();
  void ScheduleUsage();
  void RemoveExpired();
  // Writes down that sessions are no more which have expired when the disk had no room for it.
  void LogExpiries(const std::vector<SessionChange>& deletions);
  // Takes a session in, and adds its operation that has not ended to `resumed`.
  //
  // Errors:     those of Session::ResumeOperation: it has not been taken in.
  absl::Status TakeIn(const StoredSession& stored, std::vector<ResumedOperation>& resumed);
  // As OtherOwners::TakeIn.
  std::vector<std::string> TakeInOfOthers(const std::vector<StoredSession>& stored, OtherOwners::From from);
  RoomForWork GetRoomForWork() const;
  void RemoveGarbage();
  void AddMetrics(Metrics& metrics);

  const ServiceOptions options_;
  const std::shared_ptr<spdlog::logger> log_;
  const Mesher mesher_;
  const Estimator estimator_;
  const MesherFactory create_mesher_;
  const std::unique_ptr<SessionLog> session_log_;
  UsageMeter usage_;  // what jobs have told by their end is written down at this one's
  CallRegistry calls_;
  RequestIds request_ids_;
  MemoryBudget memory_;
  SessionRegistry sessions_;
  OtherOwners other_owners_;
  std::mutex unlogged_mutex_;
  std::vector<SessionChange>
      unlogged_;  // deletions of sessions that have expired, still to be made; guarded by unlogged_mutex_
  const IdleSessions idle_sessions_;
  std::atomic<uint64_t> taken_operations_ = 0;  // from servers that had offered them
  const CallEnvironment environment_;
  WorkOffers work_offers_;
  // The background thread ends first. Each other ends before those above it, and before the parts that it uses.
  Background background_;
  BlockingThreads blocking_;
  JobPool jobs_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BACKEND_H_
