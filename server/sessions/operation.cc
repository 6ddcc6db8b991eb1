#include "server/sessions/operation.h"

#include <vector>

#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

v1::Operation Operation::Describe() const {
  v1::Operation message;
  message.set_name(name_);
  *message.mutable_parameters() = ParametersToProto(parameters_);
  *message.mutable_create_time() = TimeToProto(create_time_);
  std::lock_guard lock(mutex_);
  message.set_state(state_);
  if (!events_.empty()) {
    *message.mutable_progress() = events_.back();
  }
  if (error_.code() != 0) {
    *message.mutable_error() = error_;
  }
  if (start_time_ != absl::InfiniteFuture()) {
    *message.mutable_start_time() = TimeToProto(start_time_);
  }
  if (HasEndedLocked()) {
    *message.mutable_end_time() = TimeToProto(end_time_);
  }
  message.set_mesh_revision(mesh_revision_);
  return message;
}

bool Operation::IsQueued() const {
  std::lock_guard lock(mutex_);
  return state_ == v1::Operation::STATE_QUEUED;
}

bool Operation::HasEnded() const {
  std::lock_guard lock(mutex_);
  return HasEndedLocked();
}

std::optional<v1::ProgressEvent> Operation::EventAfter(std::optional<uint64_t> after) const {
  std::lock_guard lock(mutex_);
  for (const v1::ProgressEvent& event : events_) {
    if (!after.has_value() || event.sequence() > *after) {
      return event;
    }
  }
  return std::nullopt;
}

uint64_t Operation::Watch(std::function<void()> on_change) {
  std::lock_guard lock(mutex_);
  const uint64_t watch = next_watch_++;
  watches_.emplace(watch, std::move(on_change));
  return watch;
}

void Operation::Unwatch(uint64_t watch) {
  std::lock_guard lock(mutex_);
  watches_.erase(watch);
}

bool Operation::SetJob(std::shared_ptr<Job> job) {
  std::lock_guard lock(mutex_);
  if (HasEndedLocked()) {
    return false;
  }
  job_ = std::move(job);
  return true;
}

std::shared_ptr<Job> Operation::job() const {
  std::lock_guard lock(mutex_);
  return job_;
}

bool Operation::Tick(absl::Duration now) {
  {
    std::lock_guard lock(mutex_);
    if (HasEndedLocked()) {
      return false;
    }
    std::optional<v1::ProgressEvent> event = pacer_.Next(Snapshot(), now);
    if (!event.has_value()) {
      return true;
    }
    Keep(*std::move(event));
  }
  Notify();
  return true;
}

void Operation::Start(absl::Time now) {
  std::lock_guard lock(mutex_);
  state_ = v1::Operation::STATE_RUNNING;
  start_time_ = now;
}

void Operation::Succeed(absl::Time now, uint64_t mesh_revision, uint64_t vertices, uint64_t simplices) {
  std::lock_guard lock(mutex_);
  core::Progress progress = Snapshot();
  progress.vertices = vertices;
  progress.simplices = simplices;
  Keep(pacer_.Final(progress));
  mesh_revision_ = mesh_revision;
  End(v1::Operation::STATE_SUCCEEDED, now);
}

void Operation::Fail(absl::Time now, const absl::Status& status) {
  std::lock_guard lock(mutex_);
  error_ = StatusToProto(status);
  End(absl::IsCancelled(status) ? v1::Operation::STATE_CANCELLED : v1::Operation::STATE_FAILED, now);
}

core::Progress Operation::Snapshot() const {
  return job_ == nullptr || state_ == v1::Operation::STATE_QUEUED ? core::Progress() : job_->context().Snapshot();
}

void Operation::Keep(v1::ProgressEvent event) {
  events_.push_back(std::move(event));
  if (events_.size() > kKeptEvents) {
    events_.pop_front();
  }
}

void Operation::End(v1::Operation::State state, absl::Time now) {
  state_ = state;
  end_time_ = now;
  while (events_.size() > kEventsOfEnded) {
    events_.pop_front();
  }
  job_ = nullptr;
}

void Operation::Notify() const {
  std::vector<std::function<void()>> watches;
  {
    std::lock_guard lock(mutex_);
    for (const auto& [id, on_change] : watches_) {
      watches.push_back(on_change);
    }
  }
  for (const std::function<void()>& on_change : watches) {
    on_change();
  }
}

}  // namespace wellspace::server
