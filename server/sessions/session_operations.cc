// Methods of Session about its operations.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/sessions/session.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

absl::StatusOr<std::shared_ptr<Operation>> Session::StartOperation(core::MeshParameters parameters, bool restart,
                                                                   uint64_t expected_revision, const SubmitWork& submit,
                                                                   const AnswerTo<v1::Operation>& answer) {
  std::shared_ptr<Operation> operation;
  {
    absl::MutexLock change_lock(&change_mutex_);
    WELLSPACE_RETURN_IF_ERROR(LoadInputs());
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckReady(occupancy_, *state_, stores_.point_count(), expected_revision));
    const FeatureStore& features = *stores_.features;
    WELLSPACE_RETURN_IF_ERROR(ValidateFor(features.InputOf({}), parameters));
    const bool has_mesh = CheckMesh(*state_).ok();
    if (!has_mesh) {
      WELLSPACE_RETURN_IF_ERROR(account_.CheckMesh(1));  // no mesh has fewer bytes
    }
    if ((restart || state_->steps.empty()) && has_mesh && features.Summary().AreInBox()) {
      // The box does not change with the points that have come since.
      const SessionBox box = BoxOf(*state_);
      parameters.domain_low.assign(box.low.begin(), box.low.end());
      parameters.domain_high.assign(box.high.begin(), box.high.end());
    }
    auto record =
        std::make_shared<const store::v1::OperationRecord>(NewOperation(*state_, parameters, restart, clock_.wall()));
    const std::string operation_name = NameOfOperation(*state_, record->number());
    operation = std::make_shared<Operation>(operation_name, std::move(record), std::move(parameters));
    occupancy_.BeginBusy(Busy::kStarting);
  }
  // An exception must not leave the session busy, and a worker that waits for the start.
  const absl::Status status = RunGuarded([&]() -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(submit(operation));
    return CommitStart(operation, answer);
  });
  if (status.ok()) {
    return operation;
  }
  // Its work, if it was submitted, does not begin.
  (void)operation->Apply(
      std::make_shared<const store::v1::OperationRecord>(operation->RecordOfFailure(clock_.wall(), status)));
  {
    absl::MutexLock lock(&mutex_);
    occupancy_.EndBusy(clock_.since_boot());
  }
  NoteIdle();
  return status;
}

absl::Status Session::CommitStart(const std::shared_ptr<Operation>& operation, const AnswerTo<v1::Operation>& answer) {
  absl::MutexLock change_lock(&change_mutex_);
  AppendedPoints appended;
  std::shared_ptr<PointStore> points;  // null: none to be synchronised
  {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy_, name()));  // it may have been closed meanwhile
    appended = stores_.appended();
    points = stores_.point_count() > state_->record.points() ? stores_.points : nullptr;
  }
  SessionChange change = StartChange(*state(), operation->Record(), appended);
  change.answer = AnswerRecordOf(answer, operation->Describe());
  if (points != nullptr) {
    WELLSPACE_RETURN_IF_ERROR(points->Synchronize());
  }
  return Make(change, [&] {
    mutex_.AssertHeld();
    stores_.new_crc32c = 0;
    occupancy_.busy = Busy::kOperation;
    operations_.push_back(operation);
    if (operations_.size() > kKeptOperations) {
      operations_.pop_front();
    }
  });
}

absl::StatusOr<std::shared_ptr<Operation>> Session::ResumeOperation() {
  absl::MutexLock change_lock(&change_mutex_);
  std::shared_ptr<Operation> operation;
  {
    absl::MutexLock lock(&mutex_);
    if (occupancy_.busy != Busy::kOperation) {
      return nullptr;
    }
    operation = operations_.back();
  }
  absl::Status refusal = operation->RefusalToResume();
  if (refusal.ok()) {
    refusal = LoadInputs();  // which its work needs
    if (absl::IsUnavailable(refusal)) {
      return refusal;  // of the store, not of the operation
    }
  }
  const auto record = std::make_shared<const store::v1::OperationRecord>(
      refusal.ok() ? operation->Record() : operation->RecordOfFailure(clock_.wall(), refusal));
  SessionChange change = OperationChange(*state(), *record);
  const absl::Status logged = Make(change, [] {});
  // Where the disk is full, the next process finds what this one has found.
  if (!logged.ok() && !absl::IsResourceExhausted(logged)) {
    return logged;
  }
  if (refusal.ok()) {
    return operation;
  }
  absl::MutexLock lock(&mutex_);
  (void)operation->Apply(record);  // it has no job yet
  occupancy_.EndBusy(clock_.since_boot());
  return nullptr;
}

std::optional<SessionWork> Session::BeginWork(Operation& operation) {
  {
    // An operation that is being started waits here until the log has it.
    absl::MutexLock lock(&mutex_);
    const auto is_decided = [&]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
      return occupancy_.busy != Busy::kStarting || !operation.IsQueued();
    };
    mutex_.Await(absl::Condition(&is_decided));
  }
  {
    absl::MutexLock change_lock(&change_mutex_);
    if (!operation.IsQueued()) {
      return std::nullopt;
    }
    const auto record = std::make_shared<const store::v1::OperationRecord>(operation.RecordOfStart(clock_.wall()));
    // Should the process die in this work, the next one is to know. Without that it would only try once more.
    SessionChange change = OperationChange(*state(), *record);
    const bool was_offered = IsOffered();
    const absl::Status made = Make(
        change, [] {}, NoAnswer, was_offered ? Survives::kPowerLoss : Survives::kProcessDeath);
    if (was_offered && !made.ok()) {
      return std::nullopt;
    }
    (void)operation.Apply(record);
  }
  absl::MutexLock lock(&mutex_);
  mutex_.Await(absl::Condition(HasNoQueries, &occupancy_));
  SessionWork work = work_.TakeMesher();
  work.mesh = meshes_.last();
  return work;
}

absl::Status Session::CommitSuccess(Operation& operation, WorkResult& result) {
  const uint64_t bytes = result.mesh->loaded_bytes();
  uint64_t bytes_before = 0;
  {
    absl::MutexLock lock(&mutex_);
    const std::shared_ptr<const MeshSnapshot> before = meshes_.last();
    bytes_before = before == nullptr ? 0 : before->loaded_bytes();
    WELLSPACE_RETURN_IF_ERROR(account_.TakeMesh(bytes));
  }
  // Freed without the lock.
  SizeSets sizes;
  SessionMeshes::Dropped dropped;
  SessionChange change;
  const auto show = [&] {
    mutex_.AssertHeld();
    account_.SettleMesh(bytes);
    for (const uint64_t number : change.dropped_sizes) {
      auto set = stores_.sizes.extract(number);
      account_.ReturnSizes(set.mapped()->sizes.size());
      sizes.insert(std::move(set));
    }
    if (occupancy_.is_closed) {
      result.mesh->MakeObsolete();
    }
    dropped = meshes_.Replace(std::move(result.mesh), std::move(result.delta), state_->epoch);
    std::swap(work_, result.work);
    (void)operation.Apply(RecordOfOperation(*state_, operation.number()));
    occupancy_.EndBusy(clock_.since_boot());
  };
  const absl::Status status = RunGuarded([&] {
    change_mutex_.AssertHeld();
    const store::v1::MeshRecord& mesh = result.mesh->record();
    change = SuccessChange(
        *state(), operation.RecordOfSuccess(clock_.wall(), mesh.revision(), mesh.vertices(), mesh.simplices()), mesh);
    change.usage = {UsageOf(*state(), clock_.wall(), result.processor_time, result.new_vertices)};
    return Make(change, show);
  });
  if (!status.ok()) {
    absl::MutexLock lock(&mutex_);
    account_.SettleMesh(bytes_before);
  }
  return status;
}

bool Session::EndWork(Operation& operation, WorkResult& result) {
  result.work.mesh = nullptr;  // the session alone has an earlier mesh, so that it can be given up
  {
    absl::MutexLock change_lock(&change_mutex_);
    if (result.status.ok()) {
      result.status = CommitSuccess(operation, result);
      if (!result.status.ok()) {
        result.work.mesher = nullptr;
        result.work.memory.Release();
        result.mesh->MakeObsolete();
      }
    }
    if (!result.status.ok()) {
      const bool is_parked = absl::IsCancelled(result.status) && !operation.IsCancelled() && log_.is_durable();
      const auto record = std::make_shared<const store::v1::OperationRecord>(
          is_parked ? operation.RecordOfParking() : operation.RecordOfFailure(clock_.wall(), result.status));
      SessionChange change = OperationChange(*state(), *record);
      change.usage = {UsageOf(*state(), clock_.wall(), result.processor_time, std::nullopt)};
      const absl::Status made = Make(change, [] {});
      // A failure that is not written down is no end: the next owner would go on with the operation.
      const bool is_store_away = absl::IsUnavailable(made) && !is_parked && !IsElsewhere();
      if (absl::IsResourceExhausted(made) || is_store_away) {
        return false;
      }
      if (is_parked) {
        return true;
      }
      absl::MutexLock lock(&mutex_);
      (void)operation.Apply(record);
      std::swap(work_, result.work);  // the old contents are freed without the lock
      occupancy_.EndBusy(clock_.since_boot());
    }
  }
  meshes_.YieldEarlier();
  operation.Notify();
  NoteIdle();
  return true;
}

absl::StatusOr<std::shared_ptr<Job>> Session::Cancel(Operation& operation) {
  std::shared_ptr<Job> job;
  {
    absl::MutexLock change_lock(&change_mutex_);
    if (operation.HasEnded()) {
      return nullptr;
    }
    const bool is_queued = operation.IsQueued();
    store::v1::OperationRecord record = operation.RecordOfCancel();
    if (is_queued) {
      record = operation.RecordOfFailure(clock_.wall(), absl::CancelledError("the operation was cancelled"));
      record.set_is_cancelled(true);
    }
    SessionChange change = OperationChange(*state(), record);
    WELLSPACE_RETURN_IF_ERROR(Make(change, [&] {
      mutex_.AssertHeld();
      job = operation.Apply(RecordOfOperation(*state_, operation.number()));
      if (is_queued) {
        occupancy_.EndBusy(clock_.since_boot());
      }
    }));
    if (!is_queued) {
      return operation.job();  // neither BeginWork nor EndWork can come in between
    }
  }
  operation.Notify();
  NoteIdle();
  return job;
}

absl::StatusOr<v1::Operation> Session::Tell(const Operation& operation) const {
  v1::Operation told = operation.Describe();
  // After that: an operation fails here only after its session is known to be elsewhere.
  absl::MutexLock lock(&mutex_);
  return occupancy_.is_elsewhere ? Elsewhere(name(), occupancy_.owner_address)
                                 : absl::StatusOr<v1::Operation>(std::move(told));
}

absl::StatusOr<std::shared_ptr<Operation>> Session::FindOperation(const std::string& operation_name) const {
  absl::MutexLock lock(&mutex_);
  const auto found = std::find_if(operations_.begin(), operations_.end(), [&](const std::shared_ptr<Operation>& kept) {
    return kept->name() == operation_name;
  });
  if (found == operations_.end()) {
    return MakeError(v1::ERROR_REASON_OPERATION_NOT_FOUND,
                     absl::StrCat("there is no ", operation_name, "; the last ", kKeptOperations, " are kept"), "name");
  }
  return *found;
}

std::vector<std::shared_ptr<Operation>> Session::ListOperations(uint64_t after, size_t count) const {
  std::vector<std::shared_ptr<Operation>> listed;
  absl::MutexLock lock(&mutex_);
  for (const std::shared_ptr<Operation>& operation : operations_) {
    if (operation->number() > after && listed.size() < count) {
      listed.push_back(operation);
    }
  }
  return listed;
}

}  // namespace wellspace::server
