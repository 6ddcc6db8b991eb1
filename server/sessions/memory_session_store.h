// The sessions of a process, in memory; a SessionLog has what outlives it.
#ifndef WELLSPACE_SERVER_SESSIONS_MEMORY_SESSION_STORE_H_
#define WELLSPACE_SERVER_SESSIONS_MEMORY_SESSION_STORE_H_

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/base/options.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/session_store.h"

namespace wellspace::server {

// Thread safety: thread-safe.
// Invariants: those of SessionStore. Locks of sessions are taken with that of the store held, never the other way
//             round.
class MemorySessionStore final : public SessionStore {
 public:
  // REQUIRES:   `options`, `memory` and `log` outlive this and all sessions.
  MemorySessionStore(const ServiceOptions& options, MemoryBudget& memory, Clock clock, SessionLog& log);

  absl::StatusOr<std::shared_ptr<Session>> Create(NewSession settings,
                                                  const AnswerTo<v1::Session>& answer = nullptr) override;
  absl::StatusOr<std::shared_ptr<Session>> Restore(const StoredSession& stored) override;
  absl::StatusOr<std::shared_ptr<Session>> Find(const std::string& tenant, const std::string& name) override;
  std::vector<std::shared_ptr<Session>> List(const std::string& tenant, absl::Time after, size_t count,
                                             const std::map<std::string, std::string>& labels) override;
  std::vector<std::shared_ptr<Session>> All() const override;
  bool Remove(const Session& session) override;
  size_t Count() const override;
  std::vector<std::shared_ptr<Session>> RemoveExpired() override;

 private:
  struct Tenant {
    std::shared_ptr<TenantPoints> points = std::make_shared<TenantPoints>();
    std::map<absl::Time, std::shared_ptr<Session>> sessions;  // by time of creation
    size_t pending = 0;                                       // that are being written down
  };

  // A session that has its place, but is not shown yet.
  absl::StatusOr<std::shared_ptr<Session>> Prepare(NewSession settings);

  // The following want mutex_ to be held.
  void Publish(const std::shared_ptr<Session>& session);
  // Forgets a tenant that has nothing any more.
  void DropIfEmpty(const std::string& tenant);

  const ServiceOptions& options_;
  MemoryBudget& memory_;
  const Clock clock_;
  SessionLog& log_;
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  std::unordered_map<std::string, std::shared_ptr<Session>> by_name_;
  std::map<std::string, Tenant> tenants_;  // those that have sessions
  size_t pending_ = 0;                     // of all tenants
  absl::Time last_create_time_ = absl::InfinitePast();
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_MEMORY_SESSION_STORE_H_
