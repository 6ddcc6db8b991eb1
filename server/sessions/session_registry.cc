#include "server/sessions/session_registry.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {

// 128 bits of the generator that the kernel has for keys; std::random_device does not promise as much.
std::string UnguessableSessionName() {
  std::string bits(16, '\0');
  if (getentropy(bits.data(), bits.size()) != 0) {
    std::abort();  // no kernel that this runs on is without
  }
  return absl::StrCat("sessions/", absl::BytesToHexString(bits));
}

SessionRegistry::SessionRegistry(const ServiceOptions& options, MemoryBudget& memory, Clock clock, SessionLog& log,
                                 std::function<std::string()> make_name)
    : options_(options), memory_(memory), clock_(std::move(clock)), log_(log), make_name_(std::move(make_name)) {}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Create(NewSession settings,
                                                                 const AnswerTo<v1::Session>& answer) {
  SessionChange creation;
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, Prepare(std::move(settings), &creation));
  absl::Status logged = RunGuarded([&] {  // without a lock: it takes long
    creation.answer = AnswerRecordOf(answer, session->Describe());
    return log_.is_durable() ? log_.Commit(creation) : absl::OkStatus();
  });
  std::lock_guard lock(mutex_);
  --tenants_[session->tenant()].pending;
  --pending_;
  if (!logged.ok()) {
    DropIfEmpty(session->tenant());
    return logged;
  }
  Publish(session);
  return session;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Prepare(NewSession settings, SessionChange* creation) {
  std::lock_guard lock(mutex_);
  const auto known = tenants_.find(settings.tenant);
  const size_t count = known == tenants_.end() ? 0 : known->second.sessions.size() + known->second.pending;
  if (count >= options_.max_sessions_per_tenant) {
    return MakeError(v1::ERROR_REASON_QUOTA_EXCEEDED,
                     absl::StrCat("you have ", count, " sessions, and may have at most ",
                                  options_.max_sessions_per_tenant, "; delete one"));
  }
  if (by_name_.size() + pending_ >= options_.max_sessions) {
    return MakeError(v1::ERROR_REASON_TOO_MANY_SESSIONS,
                     absl::StrCat("this server has ", by_name_.size() + pending_, " sessions, as many as it may have"));
  }
  last_create_time_ = std::max(clock_.wall(), last_create_time_ + absl::Microseconds(1));
  *creation = CreationChange({.tenant = std::move(settings.tenant),
                              .name = make_name_(),
                              .parameters = std::move(settings.parameters),
                              .labels = std::move(settings.labels),
                              .ttl = settings.ttl,
                              .create_time = last_create_time_});
  // A session that is new is one that has had no change but this.
  const StoredSession created{.state = *creation->state, .steps = {}, .operations = {}};
  Tenant& tenant = tenants_[created.state.tenant()];
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session,
                             Session::Restore(created, options_, memory_, clock_, tenant.points, log_));
  ++tenant.pending;
  ++pending_;
  return session;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Restore(const StoredSession& stored) {
  std::lock_guard lock(mutex_);
  WELLSPACE_ASSIGN_OR_RETURN(
      std::shared_ptr<Session> session,
      Session::Restore(stored, options_, memory_, clock_, tenants_[stored.state.tenant()].points, log_));
  last_create_time_ = std::max(last_create_time_, session->create_time());
  Publish(session);
  return session;
}

void SessionRegistry::Publish(const std::shared_ptr<Session>& session) {
  tenants_[session->tenant()].sessions.emplace(session->create_time(), session);
  by_name_.emplace(session->name(), session);
}

void SessionRegistry::DropIfEmpty(const std::string& tenant) {
  const auto known = tenants_.find(tenant);
  if (known != tenants_.end() && known->second.sessions.empty() && known->second.pending == 0) {
    tenants_.erase(known);
  }
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Find(const std::string& tenant, const std::string& name) {
  std::shared_ptr<Session> session;
  {
    std::lock_guard lock(mutex_);
    if (const auto found = by_name_.find(name); found != by_name_.end()) {
      session = found->second;
    }
  }
  if (session == nullptr || session->tenant() != tenant || !session->Renew()) {
    return MakeError(v1::ERROR_REASON_SESSION_NOT_FOUND,
                     absl::StrCat("there is no ", name, "; it may have been deleted, or have expired"));
  }
  return session;
}

std::vector<std::shared_ptr<Session>> SessionRegistry::List(const std::string& tenant, absl::Time after, size_t count,
                                                            const std::map<std::string, std::string>& labels) {
  std::vector<std::shared_ptr<Session>> sessions;
  {
    std::lock_guard lock(mutex_);
    if (const auto known = tenants_.find(tenant); known != tenants_.end()) {
      const auto& all = known->second.sessions;
      std::transform(all.upper_bound(after), all.end(), std::back_inserter(sessions),
                     [](const auto& session) { return session.second; });
    }
  }
  std::vector<std::shared_ptr<Session>> listed;
  for (const std::shared_ptr<Session>& session : sessions) {
    if (listed.size() < count && HasLabels(*session->state(), labels) && !session->IsExpired()) {
      listed.push_back(session);
    }
  }
  return listed;
}

std::vector<std::shared_ptr<Session>> SessionRegistry::All() const {
  std::vector<std::shared_ptr<Session>> all;
  std::lock_guard lock(mutex_);
  all.reserve(by_name_.size());
  for (const auto& [name, session] : by_name_) {
    all.push_back(session);
  }
  return all;
}

bool SessionRegistry::Remove(const Session& session) {
  std::lock_guard lock(mutex_);
  if (by_name_.erase(session.name()) == 0) {
    return false;
  }
  tenants_[session.tenant()].sessions.erase(session.create_time());
  DropIfEmpty(session.tenant());
  return true;
}

uint64_t SessionRegistry::StoredBytes(const std::string& tenant) const {
  std::lock_guard lock(mutex_);
  const auto found = tenants_.find(tenant);
  return found == tenants_.end() ? 0 : found->second.points->amount().bytes;
}

SessionRegistry::Stored SessionRegistry::StoredBytes() const {
  Stored stored;
  std::lock_guard lock(mutex_);
  for (const auto& [name, tenant] : tenants_) {
    const uint64_t bytes = tenant.points->amount().bytes;
    stored.all += bytes;
    stored.most = std::max(stored.most, bytes);
  }
  return stored;
}

size_t SessionRegistry::Count() const {
  std::lock_guard lock(mutex_);
  return by_name_.size();
}

std::vector<std::shared_ptr<Session>> SessionRegistry::RemoveExpired() {
  std::vector<std::shared_ptr<Session>> expired = All();
  std::erase_if(expired, [](const std::shared_ptr<Session>& session) { return !session->CloseIfExpired(); });
  for (const std::shared_ptr<Session>& session : expired) {
    Remove(*session);
  }
  return expired;
}

}  // namespace wellspace::server
