#include "server/sessions/session_changes.h"

#include <utility>
#include <vector>

#include "core/meshers/meshing_version.h"
#include "server/inputs/size_store.h"
#include "server/wire/convert.h"

namespace wellspace::server {
namespace {

using store::v1::OperationRecord;
using store::v1::SessionRecord;
using store::v1::StepRecord;

// A change that leaves the record as it is.
SessionChange EmptyChange(const SessionState& state) { return {.session = state.name(), .epoch = state.epoch}; }

// A change that has the record, which the caller makes another.
SessionChange RecordChange(const SessionState& state) {
  SessionChange change = EmptyChange(state);
  change.state = state.record;
  return change;
}

// The record is that of the next revision.
void Revise(SessionRecord& record) { record.set_revision(record.revision() + 1); }

bool AreSame(const store::v1::PointsFile& a, const store::v1::PointsFile& b) {
  return a.number() == b.number() && a.epoch() == b.epoch();
}

void AppendPoints(const AppendedPoints& appended, SessionChange& change) {
  SessionRecord& record = *change.state;
  if (appended.end <= record.points()) {
    return;
  }
  std::vector<store::v1::PointsFile> files = PointsFilesOf(record);
  if (files.empty() || !AreSame(files.back(), appended.file)) {
    files.push_back(appended.file);
    files.back().set_first(record.points());
    record.mutable_points_files()->Assign(files.begin(), files.end());
  }
  StepRecord::Points& points = *change.steps.emplace_back().mutable_points();
  points.set_first(record.points());
  points.set_count(appended.end - record.points());
  points.set_crc32c(appended.crc32c);
  record.set_points(appended.end);
  record.set_is_ready(false);
  Revise(record);
}

// No step is left, but one that has the sizes of now.
void DropSizesOfSteps(const SessionState& state, SessionChange& change) {
  for (const SizesInUse& set : UnusedSizes(state, {}, state.sizes().number)) {
    change.dropped_sizes.push_back(set.number);
  }
}

}  // namespace

SessionChange CreationChange(const SessionSettings& settings) {
  SessionRecord record;
  record.set_name(settings.name);
  record.set_tenant(settings.tenant);
  record.set_create_time_ns(absl::ToUnixNanos(settings.create_time));
  *record.mutable_parameters() = ParametersToProto(settings.parameters);
  record.mutable_labels()->insert(settings.labels.begin(), settings.labels.end());
  record.set_ttl_ns(absl::ToInt64Nanoseconds(settings.ttl));
  record.set_revision(1);
  record.set_next_operation(1);
  return {.session = settings.name, .epoch = settings.epoch, .is_creation = true, .state = std::move(record)};
}

SessionChange UpdateChange(const SessionState& state, const std::optional<std::map<std::string, std::string>>& labels,
                           std::optional<absl::Duration> ttl) {
  SessionChange change = RecordChange(state);
  if (labels.has_value()) {
    change.state->clear_labels();
    change.state->mutable_labels()->insert(labels->begin(), labels->end());
  }
  if (ttl.has_value()) {
    change.state->set_ttl_ns(absl::ToInt64Nanoseconds(*ttl));
  }
  return change;
}

SessionChange DeletionChange(const SessionState& state) {
  SessionChange change = EmptyChange(state);
  change.is_deletion = true;
  return change;
}

SessionChange PointsChange(const SessionState& state, const AppendedPoints& appended) {
  SessionChange change = RecordChange(state);
  AppendPoints(appended, change);
  return change;
}

SessionChange RemovalChange(const SessionState& state, const PointsThatAreLeft& left) {
  SessionChange change = RecordChange(state);
  change.steps.emplace_back().mutable_removed();
  if (left.points > 0) {
    StepRecord::Points& points = *change.steps.emplace_back().mutable_points();
    points.set_count(left.points);
    points.set_crc32c(left.crc32c);
  }
  change.state->set_points(left.points);
  change.state->set_points_file(left.file.number());
  change.state->clear_points_files();
  if (left.points > 0) {
    *change.state->add_points_files() = left.file;
  }
  change.state->set_revision(left.file.number());
  change.state->set_is_ready(false);
  DropSizesOfSteps(state, change);
  return change;
}

SessionChange FeaturesChange(const SessionState& state, const FeaturePart& part, const FeatureCounts& known,
                             const FeatureSummary& after) {
  SessionChange change = RecordChange(state);
  FeaturePart& step = *change.steps.emplace_back().mutable_features();
  step = part;
  DropKnown(known, step);
  SetFeatures(after, *change.state);
  Revise(*change.state);
  return change;
}

bool IsRevisionOfSizes(const SessionState& state, uint64_t expected) {
  return state.sizes_revision != 0 && expected == state.sizes_revision - 1;
}

SessionChange SizesChange(const SessionState& state, const std::shared_ptr<const core::SizeSamples>& samples) {
  SessionChange change = RecordChange(state);
  Revise(*change.state);
  const uint64_t number = samples == nullptr ? 0 : change.state->revision();
  change.state->set_sizes(number);
  change.state->set_size_count(samples == nullptr ? 0 : samples->sizes.size());
  if (samples != nullptr) {
    change.sizes = RecordsOf(number, samples, state.parameters->dimension);
  }
  for (const SizesInUse& set : UnusedSizes(state, state.steps, number)) {
    change.dropped_sizes.push_back(set.number);
  }
  return change;
}

OperationRecord NewOperation(const SessionState& state, const core::MeshParameters& parameters, bool restart,
                             absl::Time now) {
  OperationRecord operation;
  operation.set_number(state.record.next_operation());
  *operation.mutable_parameters() = ParametersToProto(parameters);
  operation.set_state(v1::Operation::STATE_QUEUED);
  operation.set_create_time_ns(absl::ToUnixNanos(now));
  operation.set_attempts(1);
  operation.set_restart(restart);
  return operation;
}

SessionChange StartChange(const SessionState& state, const OperationRecord& operation, const AppendedPoints& appended) {
  SessionChange change = RecordChange(state);
  AppendPoints(appended, change);
  change.state->set_next_operation(operation.number() + 1);
  change.operations.push_back(operation);
  if (state.operations.size() >= kKeptOperations) {
    change.dropped_operations.push_back(state.operations.front()->number());
  }
  return change;
}

store::v1::UsageRecord UsageOf(const SessionState& state, absl::Time now, absl::Duration processor_time,
                               std::optional<uint64_t> new_vertices) {
  store::v1::UsageRecord usage;
  usage.set_tenant(state.record.tenant());
  usage.set_day(DayOf(now));
  usage.set_meshes(new_vertices.has_value() ? 1 : 0);
  usage.set_vertices(new_vertices.value_or(0));
  usage.set_processor_time_ns(absl::ToInt64Nanoseconds(processor_time));
  return usage;
}

SessionChange OperationChange(const SessionState& state, const OperationRecord& operation) {
  SessionChange change = EmptyChange(state);
  change.operations.push_back(operation);
  return change;
}

SessionChange OfferChange(const SessionState& state, bool stands) {
  SessionChange change = EmptyChange(state);
  change.offer = WorkOffer{.stands = stands, .tenant = state.record.tenant()};
  return change;
}

SessionChange SuccessChange(const SessionState& state, const OperationRecord& operation,
                            const store::v1::MeshRecord& mesh) {
  SessionChange change = RecordChange(state);
  SessionRecord& record = *change.state;
  record.set_revision(mesh.revision());
  record.set_is_ready(true);
  *record.mutable_parameters() = operation.parameters();
  *record.mutable_mesh() = mesh;
  StepRecord::Refined& step = *change.steps.emplace_back().mutable_refined();
  step.set_points(record.points());
  *step.mutable_parameters() = operation.parameters();
  step.set_sizes(record.sizes());
  step.set_size_count(record.size_count());
  if (state.steps.empty() || operation.restart()) {
    step.set_begins(true);
    step.set_meshing_version(core::kMeshingVersion);
    DropSizesOfSteps(state, change);
  }
  change.operations.push_back(operation);
  return change;
}

SessionChange AdditionChange(const SessionState& state, const AppendedPoints& appended, uint64_t uploads_end,
                             uint64_t count) {
  SessionChange change = RecordChange(state);
  AppendPoints(appended, change);
  StepRecord::Added& step = *change.steps.emplace_back().mutable_added();
  step.set_uploads_end(uploads_end);
  step.set_end(uploads_end + count);
  return change;
}

}  // namespace wellspace::server
