// What a session does with its operations.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/meshing_version.h"
#include "server/sessions/session.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr size_t kKeptOperations = 100;

}  // namespace

void Session::KeepLocked(std::shared_ptr<Operation> operation) {
  operations_.push_back(std::move(operation));
  if (operations_.size() > kKeptOperations) {
    operations_.pop_front();
  }
}

absl::StatusOr<std::shared_ptr<Operation>> Session::StartOperation(core::MeshParameters parameters, bool restart,
                                                                   uint64_t expected_revision, const SubmitWork& submit,
                                                                   const AnswerTo<v1::Operation>& answer) {
  std::unique_lock change_lock(change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(LoadInputs());
  std::shared_ptr<Operation> operation;
  uint64_t end = 0;
  {
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckReadyForChangeLocked(expected_revision));
    WELLSPACE_RETURN_IF_ERROR(ValidateFor(features_.View(), parameters));
    if (work_.mesh == nullptr) {
      WELLSPACE_RETURN_IF_ERROR(point_account_.CheckMesh(1));  // no mesh has fewer bytes
    }
    if ((restart || steps_.empty()) && work_.mesh != nullptr && feature_summary_.AreInBox()) {
      // The box does not change with the points that have come since.
      parameters.domain_low = work_.mesh->figures().domain_low;
      parameters.domain_high = work_.mesh->figures().domain_high;
    }
    operation = std::make_shared<Operation>(absl::StrCat(name_, "/operations/", next_operation_), next_operation_,
                                            std::move(parameters), restart, clock_.wall());
    BeginBusyLocked(Busy::kStarting);
    end = PointCountLocked();
  }
  absl::Status status = submit(operation);
  if (status.ok()) {
    status = CommitStart(*operation, end, answer);
  }
  if (!status.ok()) {
    {
      std::lock_guard lock(mutex_);
      EndBusyLocked();
    }
    operation->Fail(clock_.wall(), status);  // its work, if it was submitted, does not begin
    change_lock.unlock();
    NoteIdle();
    return status;
  }
  std::lock_guard lock(mutex_);
  if (end > committed_points_) {
    uncommitted_crc32c_ = 0;
    NotePointsLocked(end);
  }
  ++next_operation_;
  busy_ = Busy::kOperation;
  KeepLocked(operation);
  return operation;
}

absl::Status Session::CommitStart(const Operation& operation, uint64_t end, const AnswerTo<v1::Operation>& answer) {
  const std::optional<store::v1::AnswerRecord> answer_record = AnswerRecordOf(answer, operation.Describe());
  if (end > committed_points_) {
    WELLSPACE_RETURN_IF_ERROR(points_->Synchronize());
  }
  return CommitState([&](SessionChange& change) {
    if (end > committed_points_) {
      AddPointsTo(change, end, uncommitted_crc32c_);
    }
    change.state->set_next_operation(operation.number() + 1);
    change.operations.push_back(operation.Record());
    if (operations_.size() == kKeptOperations) {
      change.dropped_operations.push_back(operations_.front()->number());
    }
    change.answer = answer_record;
  });
}

std::optional<SessionWork> Session::BeginWork(Operation& operation) {
  {
    // An operation that is being started waits here until the log has it.
    std::lock_guard change_lock(change_mutex_);
    if (!operation.IsQueued()) {
      return std::nullopt;
    }
    const absl::Time now = clock_.wall();
    // Should the process die in this work, the next one is to know. Without that it would only try once more.
    (void)Commit([&](SessionChange& change) { change.operations.push_back(operation.RecordOfStart(now)); },
                 SessionLog::Survives::kProcessDeath);
    operation.Start(now);
  }
  WaitForQueries();
  std::lock_guard lock(mutex_);
  return SessionWork{.memory = std::move(work_.memory),
                     .mesher = std::move(work_.mesher),
                     .meshed_points = work_.meshed_points,
                     .mesh = work_.mesh};
}

absl::Status Session::CommitSuccess(const Operation& operation, const WorkResult& result, absl::Time now) {
  return CommitState([&](SessionChange& change) {
    const MeshSnapshot& mesh = *result.mesh;
    store::v1::SessionRecord& state = *change.state;
    state.set_revision(mesh.revision());
    state.set_is_ready(true);
    *state.mutable_parameters() = ParametersToProto(operation.parameters());
    if (std::optional<store::v1::MeshRecord> record = mesh.record()) {
      *state.mutable_mesh() = *std::move(record);
    }
    store::v1::StepRecord::Refined& step = *change.steps.emplace_back().mutable_refined();
    step.set_points(committed_points_);
    *step.mutable_parameters() = state.parameters();
    step.set_sizes(sizes_in_use_.number);
    step.set_size_count(sizes_in_use_.count);
    if (steps_.empty() || operation.restart()) {
      step.set_begins(true);
      step.set_meshing_version(core::kMeshingVersion);
      for (const SizesInUse& set : UnusedSizesLocked({}, sizes_in_use_.number)) {
        change.dropped_sizes.push_back(set.number);
      }
    }
    const MeshSnapshot::Figures& figures = mesh.figures();
    change.operations.push_back(operation.RecordOfSuccess(now, figures.revision, figures.vertices, figures.simplices));
  });
}

absl::Status Session::TakeSuccess(const Operation& operation, const WorkResult& result, absl::Time now) {
  const uint64_t bytes = result.mesh->loaded_bytes();
  uint64_t bytes_before = 0;
  {
    std::lock_guard lock(mutex_);
    bytes_before = work_.mesh == nullptr ? 0 : work_.mesh->loaded_bytes();
    WELLSPACE_RETURN_IF_ERROR(point_account_.TakeMesh(bytes));
  }
  absl::Status status = CommitSuccess(operation, result, now);
  std::lock_guard lock(mutex_);
  point_account_.SettleMesh(status.ok() ? bytes : bytes_before);
  return status;
}

void Session::NoteRefinementLocked(const Operation& operation) {
  if (operation.restart()) {
    for (const SizesInUse& set : UnusedSizesLocked({}, sizes_in_use_.number)) {
      point_account_.ReturnSizes(set.count);
    }
    steps_ = SessionSteps();
  }
  parameters_ = operation.parameters();
  core::MeshParameters refined_with = parameters_;
  refined_with.size_samples = sizes_;
  steps_.NoteRefinement(committed_points_, refined_with, sizes_in_use_);
}

bool Session::EndWork(Operation& operation, WorkResult& result) {
  std::unique_lock change_lock(change_mutex_);
  const absl::Time now = clock_.wall();
  if (result.status.ok()) {
    result.status = TakeSuccess(operation, result, now);
    if (!result.status.ok()) {
      result.work.mesher = nullptr;
      result.work.memory.Release();
      result.mesh->MakeObsolete();
    }
  }
  if (!result.status.ok()) {
    const bool is_parked = absl::IsCancelled(result.status) && !operation.IsCancelled() && log_.is_durable();
    const absl::Status logged = Commit([&](SessionChange& change) {
      change.operations.push_back(is_parked ? operation.RecordOfParking()
                                            : operation.RecordOfFailure(now, result.status));
    });
    if (absl::IsResourceExhausted(logged)) {
      return false;
    }
    if (is_parked) {
      return true;
    }
  }
  std::vector<MeshDeltas::Delta> dropped;  // is freed without the lock
  {
    std::lock_guard lock(mutex_);
    SessionWork& work = result.work;
    if (result.status.ok()) {
      if (work.mesh != nullptr) {
        work.mesh->MakeObsolete();
      }
      work.mesh = std::move(result.mesh);
      if (is_closed_) {
        work.mesh->MakeObsolete();
      }
      revision_ = work.mesh->revision();
      dropped = deltas_.Advance(std::move(result.delta), work.mesh->loaded_bytes());
      work.meshed_points = committed_points_;
      NoteRefinementLocked(operation);
      is_ready_ = true;
      ++structure_version_;
      const MeshSnapshot::Figures& made = work.mesh->figures();
      operation.Succeed(now, revision_, made.vertices, made.simplices);
    } else {
      operation.Fail(now, result.status);
      work.meshed_points = steps_.points();
    }
    std::swap(work_, work);  // what was there is freed without the lock
    EndBusyLocked();
  }
  change_lock.unlock();
  operation.Notify();
  NoteIdle();
  return true;
}

absl::StatusOr<std::shared_ptr<Job>> Session::Cancel(Operation& operation) {
  std::unique_lock change_lock(change_mutex_);
  if (operation.HasEnded()) {
    return nullptr;
  }
  const absl::Time now = clock_.wall();
  const absl::Status cancelled = absl::CancelledError("the operation was cancelled");
  const bool is_queued = operation.IsQueued();
  store::v1::OperationRecord record = is_queued ? operation.RecordOfFailure(now, cancelled) : operation.Record();
  record.set_is_cancelled(true);
  WELLSPACE_RETURN_IF_ERROR(Commit([&](SessionChange& change) { change.operations.push_back(std::move(record)); }));
  operation.NoteCancel();
  if (!is_queued) {
    return operation.job();  // neither BeginWork nor EndWork can come in between
  }
  std::shared_ptr<Job> job;
  {
    std::lock_guard lock(mutex_);
    EndBusyLocked();
    job = operation.Fail(now, cancelled);
  }
  change_lock.unlock();
  operation.Notify();
  NoteIdle();
  return job;
}

absl::StatusOr<std::shared_ptr<Operation>> Session::FindOperation(const std::string& operation_name) const {
  std::lock_guard lock(mutex_);
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
  std::lock_guard lock(mutex_);
  for (const std::shared_ptr<Operation>& operation : operations_) {
    if (operation->number() > after && listed.size() < count) {
      listed.push_back(operation);
    }
  }
  return listed;
}

}  // namespace wellspace::server
