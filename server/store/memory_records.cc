#include "server/store/memory_records.h"

#include "absl/strings/str_cat.h"

namespace wellspace::server {

absl::StatusOr<std::optional<StoredSession>> MemoryRecords::Take(const std::string& session) {
  const std::lock_guard lock(mutex_);
  const auto known = epochs_.find(session);
  if (known == epochs_.end()) {
    return std::optional<StoredSession>();
  }
  known->second = ++last_epoch_;
  StoredSession taken{.epoch = known->second, .state = {}, .steps = {}, .operations = {}};
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
  const auto known = epochs_.find(change.session);
  const bool is_there = known != epochs_.end();
  if (is_there ? known->second != change.epoch : !change.is_creation && !change.is_deletion) {
    return OwnedElsewhere(change.session);
  }
  if (change.answer.has_value() &&
      !answers_.try_emplace({change.answer->tenant(), change.answer->request_id()}, *change.answer).second) {
    return AnsweredBefore(change.answer->request_id());
  }
  if (change.is_deletion) {
    epochs_.erase(change.session);
  } else if (change.is_creation) {
    epochs_[change.session] = change.epoch;
  }
  return absl::OkStatus();
}

}  // namespace wellspace::server
