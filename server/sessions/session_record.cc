// How a session is written down, and comes back.
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/meshing_version.h"
#include "server/sessions/session.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

absl::StatusOr<Session::Settings> SettingsOf(const store::v1::SessionRecord& state) {
  WELLSPACE_ASSIGN_OR_RETURN(core::MeshParameters parameters, ParametersFromRecord(state.parameters()));
  return Session::Settings{.tenant = state.tenant(),
                           .name = state.name(),
                           .parameters = std::move(parameters),
                           .labels = {state.labels().begin(), state.labels().end()},
                           .ttl = absl::Nanoseconds(state.ttl_ns()),
                           .create_time = absl::FromUnixNanos(state.create_time_ns())};
}

// The steps that the structure is made of; none, if another version of the core has made them, or points were removed
// since.
absl::StatusOr<SessionSteps> StepsOf(const std::vector<store::v1::StepRecord>& records) {
  SessionSteps steps;
  for (const store::v1::StepRecord& record : records) {
    if (record.has_removed()) {
      steps = SessionSteps();
    } else if (record.has_refined()) {
      const store::v1::StepRecord::Refined& refined = record.refined();
      if (refined.begins()) {
        steps = SessionSteps();
      }
      if (refined.begins() ? refined.meshing_version() == core::kMeshingVersion : !steps.empty()) {
        WELLSPACE_ASSIGN_OR_RETURN(const core::MeshParameters parameters, ParametersFromRecord(refined.parameters()));
        steps.NoteRefinement(refined.points(), parameters, {.number = refined.sizes(), .count = refined.size_count()});
      }
    } else if (record.has_added() && !steps.empty()) {
      steps.NoteAddition(record.added().uploads_end(), record.added().end());
    }
  }
  return steps;
}

std::vector<store::v1::StepRecord::Points> PointsOf(const std::vector<store::v1::StepRecord>& records) {
  std::vector<store::v1::StepRecord::Points> points;
  for (const store::v1::StepRecord& record : records) {
    if (record.has_removed()) {
      points.clear();
    } else if (record.has_points()) {
      points.push_back(record.points());
    }
  }
  return points;
}

}  // namespace

absl::StatusOr<std::shared_ptr<Session>> Session::Restore(const StoredSession& stored, const ServiceOptions& options,
                                                          MemoryBudget& memory, Clock clock,
                                                          std::shared_ptr<TenantPoints> tenant_points,
                                                          SessionLog& log) {
  WELLSPACE_ASSIGN_OR_RETURN(Settings settings, SettingsOf(stored.state));
  WELLSPACE_ASSIGN_OR_RETURN(SessionSteps steps, StepsOf(stored.steps));
  std::deque<std::shared_ptr<Operation>> operations;
  for (const store::v1::OperationRecord& record : stored.operations) {
    WELLSPACE_ASSIGN_OR_RETURN(core::MeshParameters parameters, ParametersFromRecord(record.parameters()));
    operations.push_back(std::make_shared<Operation>(absl::StrCat(settings.name, "/operations/", record.number()),
                                                     record, std::move(parameters)));
  }
  auto session =
      std::make_shared<Session>(std::move(settings), options, memory, std::move(clock), std::move(tenant_points), log);
  session->steps_ = std::move(steps);
  session->operations_ = std::move(operations);
  session->SetState(stored);
  return session;
}

void Session::SetState(const StoredSession& stored) {
  const store::v1::SessionRecord& state = stored.state;
  revision_ = state.revision();
  is_ready_ = state.is_ready();
  committed_points_ = state.points();
  points_file_ = state.points_file();
  points_ = log_.OpenPoints(name_, dimension_, points_file_, PointsOf(stored.steps));
  feature_summary_ = {.segments = state.segments(),
                      .seeds = state.seeds(),
                      .has_rules = state.has_rules(),
                      .faces = state.faces(),
                      .crossings = state.crossings(),
                      .snap_distance = state.snap_distance()};
  sizes_in_use_ = {.number = state.sizes(), .count = state.size_count()};
  sizes_revision_ = sizes_in_use_.number;
  const std::vector<SizesInUse> sizes = UnusedSizesLocked({}, 0);  // all of them
  are_inputs_loaded_ =
      feature_summary_.segments == 0 && feature_summary_.seeds == 0 && !feature_summary_.has_rules && sizes.empty();
  PointAccount::Held held{
      .points = committed_points_, .segments = feature_summary_.segments, .seeds = feature_summary_.seeds};
  for (const SizesInUse& set : sizes) {
    held.sizes += set.count;
  }
  if (state.has_mesh()) {
    work_.mesh = log_.FindMesh(name_, state);
    work_.meshed_points = steps_.points();
    structure_version_ = 1;
    held.mesh_bytes = work_.mesh->loaded_bytes();
  }
  point_account_.Restore(held);
  next_operation_ = state.next_operation();
  if (!operations_.empty() && !operations_.back()->HasEnded()) {
    BeginBusyLocked(Busy::kOperation);
  }
}

store::v1::SessionRecord Session::RecordLocked() const {
  store::v1::SessionRecord record;
  record.set_name(name_);
  record.set_tenant(tenant_);
  record.set_create_time_ns(absl::ToUnixNanos(create_time_));
  *record.mutable_parameters() = ParametersToProto(parameters_);
  record.mutable_labels()->insert(labels_.begin(), labels_.end());
  record.set_ttl_ns(absl::ToInt64Nanoseconds(lease_.ttl()));
  record.set_revision(revision_);
  record.set_points(committed_points_);
  record.set_points_file(points_file_);
  SetFeatures(feature_summary_, record);
  record.set_sizes(sizes_in_use_.number);
  record.set_size_count(sizes_in_use_.count);
  record.set_is_ready(is_ready_);
  record.set_next_operation(next_operation_);
  if (work_.mesh != nullptr) {
    if (std::optional<store::v1::MeshRecord> mesh = work_.mesh->record()) {
      *record.mutable_mesh() = *std::move(mesh);
    }
  }
  return record;
}

absl::Status Session::Commit(const std::function<void(SessionChange&)>& fill, SessionLog::Survives survives) {
  if (!log_.is_durable()) {
    return absl::OkStatus();
  }
  {
    std::lock_guard lock(mutex_);
    if (is_closed_) {
      return absl::OkStatus();
    }
  }
  SessionChange change{.session = name_};
  fill(change);
  return log_.Commit(change, survives);
}

absl::Status Session::CommitState(const std::function<void(SessionChange&)>& fill) {
  return Commit([&](SessionChange& change) {
    {
      std::lock_guard lock(mutex_);
      change.state = RecordLocked();
    }
    fill(change);
  });
}

absl::Status Session::LogCreation(const AnswerTo<v1::Session>& answer) {
  std::lock_guard change_lock(change_mutex_);
  const std::optional<store::v1::AnswerRecord> answer_record = AnswerRecordOf(answer, Describe());
  return CommitState([&](SessionChange& change) { change.answer = answer_record; });
}

absl::Status Session::LogExpiry() {
  if (!log_.is_durable()) {
    return absl::OkStatus();
  }
  std::lock_guard change_lock(change_mutex_);
  return log_.Commit({.session = name_, .is_deletion = true});
}

absl::StatusOr<std::shared_ptr<Operation>> Session::ResumeOperation() {
  std::lock_guard change_lock(change_mutex_);
  if (busy_ != Busy::kOperation) {
    return nullptr;
  }
  const std::shared_ptr<Operation> operation = operations_.back();
  absl::Status refusal = operation->RefusalToResume();
  if (refusal.ok()) {
    refusal = LoadInputs();  // which its work needs
  }
  const absl::Time now = clock_.wall();
  const absl::Status logged = Commit([&](SessionChange& change) {
    change.operations.push_back(refusal.ok() ? operation->Record() : operation->RecordOfFailure(now, refusal));
  });
  // Where the disk is full, the next process finds what this one has found.
  if (!logged.ok() && !absl::IsResourceExhausted(logged)) {
    return logged;
  }
  if (refusal.ok()) {
    return operation;
  }
  std::lock_guard lock(mutex_);
  operation->Fail(now, refusal);
  EndBusyLocked();
  return nullptr;
}

void Session::AddPointsTo(SessionChange& change, uint64_t end, uint32_t crc32c) const {
  store::v1::StepRecord::Points& points = *change.steps.emplace_back().mutable_points();
  points.set_first(committed_points_);
  points.set_count(end - committed_points_);
  points.set_crc32c(crc32c);
  change.state->set_points(end);
  change.state->set_revision(change.state->revision() + 1);
  change.state->set_is_ready(false);
}

void Session::NotePointsLocked(uint64_t end) {
  committed_points_ = end;
  is_ready_ = false;
  ++revision_;
}

absl::Status Session::LoadInputs() {
  if (are_inputs_loaded_) {
    return absl::OkStatus();
  }
  {
    // The log has no records any more of a session that was deleted, which would pass for damage.
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
  }
  WELLSPACE_RETURN_IF_ERROR(LoadSizes());
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<store::v1::StepRecord::Features> steps, log_.ReadFeatures(name_));
  std::lock_guard lock(mutex_);
  for (const store::v1::StepRecord::Features& step : steps) {
    features_.Append(step.segments());
    if (step.has_faces()) {
      features_.Append(step.faces());
    }
  }
  are_inputs_loaded_ = true;
  return absl::OkStatus();
}

}  // namespace wellspace::server
