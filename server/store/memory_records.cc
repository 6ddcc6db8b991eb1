#include "server/store/memory_records.h"

#include "absl/strings/str_cat.h"

namespace wellspace::server {

absl::StatusOr<std::optional<StoredSession>> MemoryRecords::Take(const std::string& session) {
  const std::lock_guard lock(mutex_);
  const auto known = sessions_.find(session);
  if (known == sessions_.end()) {
    return std::optional<StoredSession>();
  }
  known->second.epoch = ++last_epoch_;
  StoredSession taken{.epoch = known->second.epoch, .state = {}, .steps = {}, .operations = {}};
  taken.state.set_name(session);
  return taken;
}

absl::StatusOr<std::optional<store::v1::AnswerRecord>> MemoryRecords::FindAnswer(const AnswerKey& request) {
  const std::lock_guard lock(mutex_);
  const auto known = answers_.find({request.tenant, request.request_id});
  return known == answers_.end() ? std::nullopt : std::optional(known->second);
}

void MemoryRecords::Forget(std::span<const AnswerKey> answers) {
  const std::lock_guard lock(mutex_);
  for (const AnswerKey& answer : answers) {
    answers_.erase({answer.tenant, answer.request_id});
  }
}

absl::Status MemoryRecords::Apply(const SessionChange& change, Survives /*survives*/) {
  const std::lock_guard lock(mutex_);
  const auto known = sessions_.find(change.session);
  const bool is_there = known != sessions_.end();
  const bool may_be_gone = change.is_creation || change.is_deletion || change.session.empty();
  if (is_there ? known->second.epoch != change.epoch : !may_be_gone) {
    return OwnedElsewhere(change.session);
  }
  if (change.answer.has_value() &&
      !answers_.try_emplace({change.answer->tenant(), change.answer->request_id()}, *change.answer).second) {
    return AnsweredBefore(change.answer->request_id());
  }
  if (change.is_deletion) {
    sessions_.erase(change.session);
  } else if (change.state.has_value()) {
    Kept& kept = sessions_[change.session];
    kept.epoch = change.epoch;
    kept.record.set_tenant(change.state->tenant());
    kept.record.set_stored_bytes(change.state->stored_bytes());
  }
  for (const store::v1::UsageRecord& usage : change.usage) {
    store::v1::UsageRecord& sum = usage_[{usage.tenant(), usage.day()}];
    sum.set_tenant(usage.tenant());
    sum.set_day(usage.day());
    AddWork(usage, sum);
  }
  return absl::OkStatus();
}

absl::StatusOr<UsageByTenant> MemoryRecords::ReadUsage(const UsageRange& range) {
  const auto is_wanted = [&](const std::string& tenant) { return range.tenant.empty() || range.tenant == tenant; };
  UsageByTenant usage;
  const std::lock_guard lock(mutex_);
  for (const auto& [key, record] : usage_) {
    if (is_wanted(key.first) && key.second >= range.first_day && key.second <= range.last_day) {
      AddWork(record, usage);
    }
  }
  for (const auto& [name, session] : sessions_) {
    if (is_wanted(session.record.tenant())) {
      AddSession(session.record, usage);
    }
  }
  return usage;
}

}  // namespace wellspace::server
