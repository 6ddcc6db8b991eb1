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
                                 std::function<std::string()> make_name, std::optional<Others> others)
    : options_(options),
      memory_(memory),
      clock_(std::move(clock)),
      log_(log),
      make_name_(std::move(make_name)),
      others_(std::move(others)) {}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Create(NewSession settings,
                                                                 const AnswerTo<v1::Session>& answer) {
  const std::string tenant = settings.tenant;
  std::shared_ptr<TenantPoints> points;
  absl::Time create_time;
  WELLSPACE_RETURN_IF_ERROR(TakePlace(tenant, &points, &create_time));
  std::shared_ptr<Session> session;
  absl::Status logged = RunGuarded([&]() -> absl::Status {  // without a lock: it takes long
    SessionChange creation = CreationChange({.tenant = tenant,
                                             .name = make_name_(),
                                             .parameters = std::move(settings.parameters),
                                             .labels = std::move(settings.labels),
                                             .ttl = settings.ttl,
                                             .create_time = create_time,
                                             .epoch = log_.records().epoch()});
    // A session that is new is one that has had no change but this.
    const StoredSession created{.epoch = creation.epoch, .state = *creation.state, .steps = {}, .operations = {}};
    WELLSPACE_ASSIGN_OR_RETURN(session, Session::Restore(created, options_, memory_, clock_, points, log_));
    creation.answer = AnswerRecordOf(answer, session->Describe());
    const absl::Status committed = log_.Commit(creation);
    return IsOwnedElsewhere(committed) ? Elsewhere(session->name()) : committed;
  });
  std::lock_guard lock(mutex_);
  --tenants_[tenant].pending;
  --pending_;
  if (!logged.ok()) {
    DropIfEmpty(tenant);
    return logged;
  }
  Publish(session);
  return session;
}

absl::Status SessionRegistry::TakePlace(const std::string& tenant_name, std::shared_ptr<TenantPoints>* points,
                                        absl::Time* create_time) {
  std::lock_guard lock(mutex_);
  const auto known = tenants_.find(tenant_name);
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
  *create_time = last_create_time_;
  Tenant& tenant = tenants_[tenant_name];
  *points = tenant.points;
  ++tenant.pending;
  ++pending_;
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Restore(const StoredSession& stored) {
  if (const std::shared_ptr<Session> before = FindHere(stored.state.name()); before != nullptr) {
    before->NoteElsewhere();
    Remove(*before);
  }
  std::shared_ptr<TenantPoints> points;
  {
    std::lock_guard lock(mutex_);
    points = tenants_[stored.state.tenant()].points;
  }
  absl::StatusOr<std::shared_ptr<Session>> session =
      Session::Restore(stored, options_, memory_, clock_, std::move(points), log_);
  std::lock_guard lock(mutex_);
  if (!session.ok()) {
    unrestored_[stored.state.name()] = {stored.state.tenant(), std::string(session.status().message())};
    DropIfEmpty(stored.state.tenant());
    return session;
  }
  unrestored_.erase(stored.state.name());
  last_create_time_ = std::max(last_create_time_, (*session)->create_time());
  Publish(*session);
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

std::shared_ptr<Session> SessionRegistry::FindHere(const std::string& name) const {
  std::lock_guard lock(mutex_);
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : found->second;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Find(const std::string& tenant, const std::string& name) {
  WELLSPACE_RETURN_IF_ERROR(log_.records().CheckOwnership());
  std::shared_ptr<Session> session = FindHere(name);
  if (others_.has_value() && (session == nullptr || session->IsElsewhere() || session->IsOffered())) {
    WELLSPACE_RETURN_IF_ERROR(others_->find(tenant, name));
    session = FindHere(name);
  }
  if (session == nullptr) {
    WELLSPACE_RETURN_IF_ERROR(FindUnrestored(tenant, name));
  }
  const bool is_own = session != nullptr && (tenant == kAnyTenant || session->tenant() == tenant);
  if (is_own && session->IsElsewhere()) {
    return Elsewhere(name);
  }
  return is_own && session->Renew() ? absl::StatusOr<std::shared_ptr<Session>>(session) : NoSuchSession(name);
}

absl::Status SessionRegistry::FindUnrestored(const std::string& tenant, const std::string& name) const {
  std::lock_guard lock(mutex_);
  const auto found = unrestored_.find(name);
  return found == unrestored_.end() || (tenant != kAnyTenant && found->second.tenant != tenant)
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_FILE_DAMAGED,
                         absl::StrCat(name, " is stored, and this server cannot restore it: ", found->second.message));
}

absl::Status SessionRegistry::ErrorOfFile(const Session& session, const absl::Status& status) const {
  if (!absl::IsDataLoss(status)) {
    return status;
  }
  if (session.IsElsewhere()) {
    return Elsewhere(session.name());
  }
  if (others_.has_value() && session.IsOffered()) {
    WELLSPACE_RETURN_IF_ERROR(others_->find(session.tenant(), session.name()));
  }
  return status;
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
  LeaveOutTaken(sessions);
  std::vector<std::shared_ptr<Session>> listed;
  for (const std::shared_ptr<Session>& session : sessions) {
    if (listed.size() < count && HasLabels(*session->state(), labels) && !session->IsExpired() &&
        !session->IsElsewhere()) {
      listed.push_back(session);
    }
  }
  return listed;
}

void SessionRegistry::LeaveOutTaken(std::vector<std::shared_ptr<Session>>& sessions) const {
  const auto is_offered = [](const std::shared_ptr<Session>& session) { return session->IsOffered(); };
  if (!others_.has_value() || std::ranges::none_of(sessions, is_offered)) {
    return;
  }
  const absl::StatusOr<std::set<std::string>> offered = others_->list_offered();
  if (!offered.ok()) {
    return;
  }
  std::erase_if(sessions, [&](const std::shared_ptr<Session>& session) {
    if (!is_offered(session) || offered->contains(session->name())) {
      return false;
    }
    // It was taken, or its offer begins or ends just now.
    const absl::Status found = others_->find(session->tenant(), session->name());
    return absl::IsNotFound(found) || session->IsElsewhere() || IsElsewhereError(found);
  });
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
  const auto found = by_name_.find(session.name());
  if (found == by_name_.end() || found->second.get() != &session) {
    return false;
  }
  by_name_.erase(found);
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
