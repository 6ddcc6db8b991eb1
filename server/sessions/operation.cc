#include "server/sessions/operation.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// So often the process may die in the work of an operation. The last time it has run alone, so that it is to blame.
constexpr uint32_t kMostCrashes = 3;

// Room for the numbers of the events of one process.
constexpr int kAttemptShift = 32;

absl::Time TimeOf(int64_t nanoseconds) {
  return nanoseconds == 0 ? absl::InfiniteFuture() : absl::FromUnixNanos(nanoseconds);
}

int64_t NanosecondsOf(absl::Time time) { return time == absl::InfiniteFuture() ? 0 : absl::ToUnixNanos(time); }

bool IsEnd(v1::Operation::State state) {
  return state != v1::Operation::STATE_QUEUED && state != v1::Operation::STATE_RUNNING;
}

v1::Operation::State EndOf(const absl::Status& status) {
  return absl::IsCancelled(status) ? v1::Operation::STATE_CANCELLED : v1::Operation::STATE_FAILED;
}

}  // namespace

Operation::Operation(std::string name, const store::v1::OperationRecord& record, core::MeshParameters parameters)
    : name_(std::move(name)),
      number_(record.number()),
      parameters_(std::move(parameters)),
      restart_(record.restart()),
      create_time_(absl::FromUnixNanos(record.create_time_ns())),
      attempts_(record.attempts() + (IsEnd(record.state()) ? 0 : 1)),
      crashes_(record.crashes() + (record.state() == v1::Operation::STATE_RUNNING ? 1 : 0)),
      state_(IsEnd(record.state()) ? record.state() : v1::Operation::STATE_QUEUED),
      end_time_(TimeOf(record.end_time_ns())),
      is_cancelled_(record.is_cancelled()),
      mesh_revision_(record.mesh_revision()),
      error_(record.error()),
      pacer_(uint64_t{attempts_ - 1} << kAttemptShift) {
  if (IsEnd(state_)) {
    start_time_ = TimeOf(record.start_time_ns());
    if (record.has_progress()) {
      events_.push_back(record.progress());
    }
  }
}

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
  message.set_restart(restart_);
  return message;
}

bool Operation::IsQueued() const {
  std::lock_guard lock(mutex_);
  return state_ == v1::Operation::STATE_QUEUED;
}

bool Operation::IsCancelled() const {
  std::lock_guard lock(mutex_);
  return is_cancelled_;
}

bool Operation::IsSuspect() const { return crashes_ > 0; }

bool Operation::RunsAlone() const { return crashes_ + 1 >= kMostCrashes; }

store::v1::OperationRecord Operation::RecordLocked() const {
  store::v1::OperationRecord record;
  record.set_number(number_);
  *record.mutable_parameters() = ParametersToProto(parameters_);
  record.set_state(state_);
  record.set_create_time_ns(absl::ToUnixNanos(create_time_));
  record.set_start_time_ns(NanosecondsOf(start_time_));
  record.set_end_time_ns(NanosecondsOf(end_time_));
  record.set_attempts(attempts_);
  record.set_crashes(crashes_);
  record.set_is_cancelled(is_cancelled_);
  if (error_.code() != 0) {
    *record.mutable_error() = error_;
  }
  record.set_mesh_revision(mesh_revision_);
  record.set_restart(restart_);
  return record;
}

store::v1::OperationRecord Operation::Record() const {
  std::lock_guard lock(mutex_);
  return RecordLocked();
}

store::v1::OperationRecord Operation::RecordOfStart(absl::Time now) const {
  store::v1::OperationRecord record = Record();
  record.set_state(v1::Operation::STATE_RUNNING);
  record.set_start_time_ns(absl::ToUnixNanos(now));
  return record;
}

store::v1::OperationRecord Operation::RecordOfSuccess(absl::Time now, uint64_t mesh_revision, uint64_t vertices,
                                                      uint64_t simplices) const {
  std::lock_guard lock(mutex_);
  store::v1::OperationRecord record = RecordLocked();
  record.set_state(v1::Operation::STATE_SUCCEEDED);
  record.set_end_time_ns(absl::ToUnixNanos(now));
  record.set_mesh_revision(mesh_revision);
  core::Progress progress = Snapshot();
  progress.vertices = vertices;
  progress.simplices = simplices;
  ProgressPacer pacer = pacer_;  // the operation has not ended yet
  *record.mutable_progress() = pacer.Final(progress);
  // Events may come before the end. A watcher of the next process is to hear this one, whatever it has heard.
  record.mutable_progress()->set_sequence((uint64_t{attempts_} << kAttemptShift) - 1);
  return record;
}

store::v1::OperationRecord Operation::RecordOfFailure(absl::Time now, const absl::Status& status) const {
  store::v1::OperationRecord record = Record();
  record.set_state(EndOf(status));
  record.set_end_time_ns(absl::ToUnixNanos(now));
  *record.mutable_error() = StatusToProto(status);
  return record;
}

store::v1::OperationRecord Operation::RecordOfParking() const {
  store::v1::OperationRecord record = Record();
  record.set_state(v1::Operation::STATE_QUEUED);
  record.set_start_time_ns(0);
  return record;
}

absl::Status Operation::RefusalToResume() const {
  if (IsCancelled()) {
    return absl::CancelledError("the operation was cancelled");
  }
  if (crashes_ >= kMostCrashes) {
    return MakeError(v1::ERROR_REASON_WORK_CRASHED,
                     absl::StrCat("the server died ", crashes_, " times while it worked at ", name_,
                                  ", at last with nothing beside it, and does not try it again; change its parameters "
                                  "or its points"));
  }
  return absl::OkStatus();
}

void Operation::NoteCancel() {
  std::lock_guard lock(mutex_);
  is_cancelled_ = true;
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

std::shared_ptr<Job> Operation::Fail(absl::Time now, const absl::Status& status) {
  std::lock_guard lock(mutex_);
  error_ = StatusToProto(status);
  return End(EndOf(status), now);
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

std::shared_ptr<Job> Operation::End(v1::Operation::State state, absl::Time now) {
  state_ = state;
  end_time_ = now;
  while (events_.size() > kEventsOfEnded) {
    events_.pop_front();
  }
  return std::exchange(job_, nullptr);
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
