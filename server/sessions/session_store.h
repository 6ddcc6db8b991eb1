// Where the server keeps its sessions.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_STORE_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_STORE_H_

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/mesh_parameters.h"
#include "server/sessions/session.h"

namespace wellspace::server {

// What a new session is made of.
struct NewSession {
  std::string tenant;
  core::MeshParameters parameters;
  std::map<std::string, std::string> labels;
  absl::Duration ttl;
};

// The sessions of all tenants. No tenant sees those of another.
//
// Thread safety: thread-safe.
// Invariants: (1) never more sessions than the limits of the server allow; (2) names are never used again, and cannot
//             be guessed.
class SessionStore {
 public:
  virtual ~SessionStore() = default;

  // Makes a session without points, and has it written down.
  //
  // Errors:     QUOTA_EXCEEDED (the tenant's sessions), TOO_MANY_SESSIONS (the server's); DISK_FULL, STORE_FAILED.
  virtual absl::StatusOr<std::shared_ptr<Session>> Create(NewSession settings,
                                                          const AnswerTo<v1::Session>& answer = nullptr) = 0;

  // Takes a session in that was written down before the server was started, whatever the limits are now.
  //
  // Errors:     those of Session::Restore.
  virtual absl::StatusOr<std::shared_ptr<Session>> Restore(const StoredSession& stored) = 0;

  // The session `name` of `tenant`, its lease renewed.
  //
  // Errors:     SESSION_NOT_FOUND: there is none, it has expired, or it is another tenant's.
  virtual absl::StatusOr<std::shared_ptr<Session>> Find(const std::string& tenant, const std::string& name) = 0;

  // Of the sessions of `tenant` that were created after `after`, in the order of their creation, the first `count` that
  // have all of `labels`. No two sessions of a store were created at the same time.
  virtual std::vector<std::shared_ptr<Session>> List(const std::string& tenant, absl::Time after, size_t count,
                                                     const std::map<std::string, std::string>& labels) = 0;

  // All sessions, of all tenants, in no order.
  virtual std::vector<std::shared_ptr<Session>> All() const = 0;

  // Takes `session` out of the store. False when it is not there any more.
  virtual bool Remove(const Session& session) = 0;

  // How many there are, of all tenants.
  virtual size_t Count() const = 0;

  // Takes those out whose lease has run out. The caller is to have their end written down (Session::LogExpiry).
  virtual std::vector<std::shared_ptr<Session>> RemoveExpired() = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_STORE_H_
