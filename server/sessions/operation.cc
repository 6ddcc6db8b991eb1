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

bool IsEnd(v1::Operation::State state) {
  return state != v1::Operation::STATE_QUEUED && state != v1::Operation::STATE_RUNNING;
}

v1::Operation::State EndOf(const absl::Status& status) {
  return absl::IsCancelled(status) ? v1::Operation::STATE_CANCELLED : v1::Operation::STATE_FAILED;
}

}  // namespace

Operation::Operation(std::string name, std::shared_ptr<const store::v1::OperationRecord> record,
                     core::MeshParameters parameters)
    : name_(std::move(name)),
      parameters_(std::move(parameters)),
      number_(record->number()),
      restart_(record->restart()),
      crashes_(record->crashes()),
      record_(std::move(record)),
      pacer_(uint64_t{record_->attempts() - 1} << kAttemptShift) {
  if (record_->has_progress()) {
    events_.push_back(record_->progress());
  }
}

std::shared_ptr<const store::v1::OperationRecord> Operation::Resumed(
    std::shared_ptr<const store::v1::OperationRecord> record) {
  if (IsEnd(record->state())) {
    return record;
  }
  auto resumed = std::make_shared<store::v1::OperationRecord>(*record);
  resumed->set_attempts(record->attempts() + 1);
  resumed->set_crashes(record->crashes() + (record->state() == v1::Operation::STATE_RUNNING ? 1 : 0));
  resumed->set_state(v1::Operation::STATE_QUEUED);
  resumed->set_start_time_ns(0);
  return resumed;
}

v1::Operation Operation::Describe(const std::string& name, const store::v1::OperationRecord& record) {
  v1::Operation message;
  message.set_name(name);
  *message.mutable_parameters() = record.parameters();
  *message.mutable_create_time() = TimeToProto(absl::FromUnixNanos(record.create_time_ns()));
  message.set_state(record.state());
  if (record.has_progress()) {
    *message.mutable_progress() = record.progress();
  }
  if (record.has_error()) {
    *message.mutable_error() = record.error();
  }
  if (record.start_time_ns() != 0) {
    *message.mutable_start_time() = TimeToProto(absl::FromUnixNanos(record.start_time_ns()));
  }
  if (record.end_time_ns() != 0) {
    *message.mutable_end_time() = TimeToProto(absl::FromUnixNanos(record.end_time_ns()));
  }
  message.set_mesh_revision(record.mesh_revision());
  message.set_restart(record.restart());
  return message;
}

v1::Operation Operation::Describe() const {
  std::lock_guard lock(mutex_);
  v1::Operation message = Describe(name_, *record_);
  if (!events_.empty()) {
    *message.mutable_progress() = events_.back();
  }
  return message;
}

bool Operation::IsQueued() const {
  std::lock_guard lock(mutex_);
  return record_->state() == v1::Operation::STATE_QUEUED;
}

bool Operation::IsCancelled() const {
  std::lock_guard lock(mutex_);
  return record_->is_cancelled();
}

bool Operation::IsSuspect() const { return crashes_ > 0; }

bool Operation::RunsAlone() const { return crashes_ + 1 >= kMostCrashes; }

store::v1::OperationRecord Operation::Record() const {
  std::lock_guard lock(mutex_);
  return *record_;
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
  store::v1::OperationRecord record = *record_;
  record.set_state(v1::Operation::STATE_SUCCEEDED);
  record.set_end_time_ns(absl::ToUnixNanos(now));
  record.set_mesh_revision(mesh_revision);
  core::Progress progress = Snapshot();
  progress.vertices = vertices;
  progress.simplices = simplices;
  ProgressPacer pacer = pacer_;  // the operation has not ended yet
  *record.mutable_progress() = pacer.Final(progress);
  // Events may come before the end. A watcher of the next process is to hear this one, whatever it has heard.
  record.mutable_progress()->set_sequence((uint64_t{record.attempts()} << kAttemptShift) - 1);
  return record;
}

store::v1::OperationRecord Operation::RecordOfFailure(absl::Time now, const absl::Status& status) const {
  store::v1::OperationRecord record = Record();
  record.set_state(EndOf(status));
  record.set_end_time_ns(absl::ToUnixNanos(now));
  *record.mutable_error() = StatusToProto(status);
  return record;
}

store::v1::OperationRecord Operation::RecordOfCancel() const {
  store::v1::OperationRecord record = Record();
  record.set_is_cancelled(true);
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

bool Operation::HasEnded() const {
  std::lock_guard lock(mutex_);
  return IsEnd(record_->state());
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
  if (IsEnd(record_->state())) {
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
    if (IsEnd(record_->state())) {
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

std::shared_ptr<Job> Operation::Apply(std::shared_ptr<const store::v1::OperationRecord> record) {
  std::lock_guard lock(mutex_);
  record_ = std::move(record);
  if (!IsEnd(record_->state())) {
    return nullptr;
  }
  if (record_->has_progress()) {
    Keep(pacer_.Final(record_->progress()));
  }
  while (events_.size() > kEventsOfEnded) {
    events_.pop_front();
  }
  return std::exchange(job_, nullptr);
}

core::Progress Operation::Snapshot() const {
  return job_ == nullptr || record_->state() == v1::Operation::STATE_QUEUED ? core::Progress()
                                                                            : job_->context().Snapshot();
}

void Operation::Keep(v1::ProgressEvent event) {
  events_.push_back(std::move(event));
  if (events_.size() > kKeptEvents) {
    events_.pop_front();
  }
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
