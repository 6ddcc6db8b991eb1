// The sessions of a process, in memory; a SessionLog has the data that outlive it.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_REGISTRY_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_REGISTRY_H_

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/input/mesh_parameters.h"
#include "server/base/options.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/session.h"

namespace wellspace::server {

// The properties of a session that is to be created.
struct NewSession {
  std::string tenant;
  core::MeshParameters parameters;
  std::map<std::string, std::string> labels;
  absl::Duration ttl;
};

// "sessions/{session}", with 128 bits of chance.
std::string UnguessableSessionName();

// The sessions of all tenants. No tenant sees those of another.
//
// Thread safety: thread-safe. No session is asked anything under the lock of the registry: one that is written to, or
//                read, may hold its own lock for a while, and must not hold up the others.
// Invariants: (1) never more sessions than the limits of the server allow, but those of Restore; (2) names are never
//             used again, and cannot be guessed.
class SessionRegistry {
 public:
  // In the place of the name of a tenant: whosever it is. It is no name that a tenant can have.
  static constexpr char kAnyTenant[] = "";

  // Questions about sessions that other processes may have. They are asked without a lock, and answered soon.
  struct Others {
    // OK: the session is this process's; it may have been taken in meanwhile (Restore). Errors: those of Find.
    std::function<absl::Status(const std::string& tenant, const std::string& name)> find;
    // The names of the sessions that this process offers, and still owns. Errors: STORE_FAILED.
    std::function<absl::StatusOr<std::set<std::string>>()> list_offered;
  };

  // REQUIRES:   `options`, `memory` and `log` outlive this and all sessions.
  // `make_name` makes the names of new sessions, no two the same; another one is for tests. `others`: none, where no
  // other process shares the log.
  SessionRegistry(const ServiceOptions& options, MemoryBudget& memory, Clock clock, SessionLog& log,
                  std::function<std::string()> make_name = UnguessableSessionName,
                  std::optional<Others> others = std::nullopt);

  // Makes a session without points, and has it written down.
  //
  // Errors:     QUOTA_EXCEEDED (the tenant's sessions), TOO_MANY_SESSIONS (the server's); DISK_FULL, STORE_FAILED.
  absl::StatusOr<std::shared_ptr<Session>> Create(NewSession settings, const AnswerTo<v1::Session>& answer = nullptr);

  // Takes a session in that another process has had, or this one before it was restarted, whatever the limits are now.
  // One of its name that was here is closed: it is another server's, or was before this.
  //
  // Errors:     those of Session::Restore, which Find tells of, too, until it can be restored.
  absl::StatusOr<std::shared_ptr<Session>> Restore(const StoredSession& stored);

  // The session `name` of `tenant`, its lease renewed.
  //
  // Errors:     SESSION_NOT_FOUND: there is none, it has expired, or it is another tenant's. SESSION_ELSEWHERE: another
  //             server has it. STORE_FAILED: it cannot be found out now who has it. FILE_DAMAGED: it is this server's,
  //             which could not restore it.
  absl::StatusOr<std::shared_ptr<Session>> Find(const std::string& tenant, const std::string& name);

  // The same of any tenant's.
  absl::StatusOr<std::shared_ptr<Session>> FindOfAnyTenant(const std::string& name) { return Find(kAnyTenant, name); }

  // The session `name`, whosever it is, as it is. Null: it is not here.
  std::shared_ptr<Session> FindHere(const std::string& name) const;

  // Of the sessions of `tenant` that were created after `after`, in the order of their creation, the first `count` that
  // have all of `labels`. No two sessions were created at the same time.
  std::vector<std::shared_ptr<Session>> List(const std::string& tenant, absl::Time after, size_t count,
                                             const std::map<std::string, std::string>& labels);

  // An error of a call on `session`, whose file another process may have removed that has taken the session over:
  // SESSION_ELSEWHERE then, and STORE_FAILED where that cannot be found out now. Else `status`, as it is.
  absl::Status ErrorOfFile(const Session& session, const absl::Status& status) const;

  // All sessions, of all tenants, in no order.
  std::vector<std::shared_ptr<Session>> All() const;

  // Takes `session` out. False when it is not there any more, or another of its name.
  bool Remove(const Session& session);

  // How many there are, of all tenants.
  size_t Count() const;

  // Bytes that the sessions of a tenant keep; those of all tenants together, and of the tenant that keeps most.
  uint64_t StoredBytes(const std::string& tenant) const;
  struct Stored {
    uint64_t all = 0;
    uint64_t most = 0;
  };
  Stored StoredBytes() const;

  // Takes those out whose lease has run out. The caller is to have their end written down (Session::LogExpiry).
  std::vector<std::shared_ptr<Session>> RemoveExpired();

 private:
  struct Tenant {
    std::shared_ptr<TenantPoints> points = std::make_shared<TenantPoints>();
    std::map<absl::Time, std::shared_ptr<Session>> sessions;  // by time of creation
    size_t pending = 0;                                       // that are being written down
  };

  // Takes a place for a session of `tenant` that is going to be made.
  //
  // Errors:     QUOTA_EXCEEDED, TOO_MANY_SESSIONS.
  absl::Status TakePlace(const std::string& tenant, std::shared_ptr<TenantPoints>* points, absl::Time* create_time);

  // Takes those out that another process has taken over, of those that are offered. If the store does not say, they are
  // taken for this process's.
  void LeaveOutTaken(std::vector<std::shared_ptr<Session>>& sessions) const;
  // The error of Restore for the session `name`, if there was one.
  absl::Status FindUnrestored(const std::string& tenant, const std::string& name) const;

  // The following want mutex_ to be held.
  void Publish(const std::shared_ptr<Session>& session);
  // Forgets a tenant that has nothing any more.
  void DropIfEmpty(const std::string& tenant);

  const ServiceOptions& options_;
  MemoryBudget& memory_;
  const Clock clock_;
  SessionLog& log_;
  const std::function<std::string()> make_name_;
  const std::optional<Others> others_;
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  std::unordered_map<std::string, std::shared_ptr<Session>> by_name_;
  std::map<std::string, Tenant> tenants_;  // those that have, or have had, sessions
  // Sessions that could not be restored, by name.
  struct Unrestored {
    std::string tenant;
    std::string message;
  };
  std::unordered_map<std::string, Unrestored> unrestored_;
  size_t pending_ = 0;  // of all tenants
  absl::Time last_create_time_ = absl::InfinitePast();
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_REGISTRY_H_
