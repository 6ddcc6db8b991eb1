#include "server/sessions/session_state.h"

#include <algorithm>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/meshers/meshing_version.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

using store::v1::OperationRecord;
using store::v1::StepRecord;

// Only a refinement changes the parameters.
absl::Status ApplyRecord(const SessionChange& change, SessionState& state) {
  const store::v1::SessionRecord& record = *change.state;
  if (record.sizes() != state.record.sizes()) {
    state.sizes_revision = record.sizes() != 0 ? record.sizes() : record.revision();
  }
  state.record = record;
  if (state.parameters == nullptr || std::ranges::any_of(change.steps, &StepRecord::has_refined)) {
    WELLSPACE_ASSIGN_OR_RETURN(core::MeshParameters parameters, ParametersFromRecord(record.parameters()));
    state.parameters = std::make_shared<const core::MeshParameters>(std::move(parameters));
  }
  return absl::OkStatus();
}

// A refinement that begins a structure takes the place of all steps before. Steps of another version of the core
// cannot be made again, and neither can those that follow.
absl::Status ApplyRefinement(const StepRecord::Refined& refined, SessionSteps& steps) {
  if (refined.begins()) {
    steps = SessionSteps();
  }
  if (refined.begins() ? refined.meshing_version() != core::kMeshingVersion : steps.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(core::MeshParameters parameters, ParametersFromRecord(refined.parameters()));
  steps.NoteRefinement(refined.points(), std::make_shared<const core::MeshParameters>(std::move(parameters)),
                       {.number = refined.sizes(), .count = refined.size_count()});
  return absl::OkStatus();
}

absl::Status ApplyStep(const StepRecord& step, SessionState& state) {
  switch (step.step_case()) {
    case StepRecord::kRefined:
      ++state.structure_version;
      return ApplyRefinement(step.refined(), state.steps);
    case StepRecord::kAdded:
      ++state.structure_version;
      if (!state.steps.empty()) {
        state.steps.NoteAddition(step.added().uploads_end(), step.added().end());
      }
      return absl::OkStatus();
    case StepRecord::kRemoved:
      ++state.structure_version;
      state.steps = SessionSteps();
      return absl::OkStatus();
    case StepRecord::kPoints:    // the record counts them
    case StepRecord::kFeatures:  // these, too
    case StepRecord::STEP_NOT_SET:
      break;
  }
  return absl::OkStatus();
}

// Where the operation of this number is, or comes.
template <typename Operations>
auto PlaceOf(uint64_t number, Operations& operations) {
  return std::ranges::lower_bound(operations, number, {}, [](const auto& operation) { return operation->number(); });
}

void ApplyOperation(const OperationRecord& record, SessionState& state) {
  const auto place = PlaceOf(record.number(), state.operations);
  auto kept = std::make_shared<const OperationRecord>(record);
  if (place != state.operations.end() && (*place)->number() == record.number()) {
    *place = std::move(kept);
  } else {
    state.operations.insert(place, std::move(kept));
  }
}

}  // namespace

absl::StatusOr<SessionState> Apply(const SessionState& before, const SessionChange& change) {
  SessionState state = before;
  state.is_deleted |= change.is_deletion;
  if (change.state.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(ApplyRecord(change, state));
  }
  for (const StepRecord& step : change.steps) {
    WELLSPACE_RETURN_IF_ERROR(ApplyStep(step, state));
  }
  for (const OperationRecord& operation : change.operations) {
    ApplyOperation(operation, state);
  }
  std::erase_if(state.operations, [&](const auto& operation) {
    return std::ranges::find(change.dropped_operations, operation->number()) != change.dropped_operations.end();
  });
  return state;
}

absl::StatusOr<SessionState> StateOf(const StoredSession& stored) {
  SessionState empty;
  empty.epoch = stored.epoch;
  return Apply(
      empty,
      {.session = stored.state.name(), .state = stored.state, .steps = stored.steps, .operations = stored.operations});
}

std::vector<StepRecord::Points> PointsOf(const std::vector<StepRecord>& steps) {
  std::vector<StepRecord::Points> points;
  for (const StepRecord& step : steps) {
    if (step.has_removed()) {
      points.clear();
    } else if (step.has_points()) {
      points.push_back(step.points());
    }
  }
  return points;
}

SessionBox BoxOf(const SessionState& state) {
  const store::v1::MeshRecord& mesh = state.record.mesh();
  const auto view = [](const auto& numbers) { return std::span(numbers.data(), static_cast<size_t>(numbers.size())); };
  return state.record.has_mesh()
             ? SessionBox{.low = view(mesh.domain_low()), .high = view(mesh.domain_high())}
             : SessionBox{.low = state.parameters->domain_low, .high = state.parameters->domain_high};
}

std::string NameOfOperation(const SessionState& state, uint64_t number) {
  return absl::StrCat(state.name(), "/operations/", number);
}

std::shared_ptr<const OperationRecord> RecordOfOperation(const SessionState& state, uint64_t number) {
  return *PlaceOf(number, state.operations);
}

bool HasLabels(const SessionState& state, const std::map<std::string, std::string>& labels) {
  return std::ranges::all_of(labels, [&](const auto& label) {
    const auto found = state.record.labels().find(label.first);
    return found != state.record.labels().end() && found->second == label.second;
  });
}

std::vector<SizesInUse> UnusedSizes(const SessionState& state, const SessionSteps& steps, uint64_t current) {
  std::vector<SizesInUse> had = state.steps.sizes();
  if (state.sizes().number != 0 && std::ranges::find(had, state.sizes()) == had.end()) {
    had.push_back(state.sizes());
  }
  const std::vector<SizesInUse> kept = steps.sizes();
  std::erase_if(
      had, [&](const SizesInUse& set) { return set.number == current || std::ranges::find(kept, set) != kept.end(); });
  return had;
}

uint64_t RevisionWith(const SessionState& state, uint64_t points) {
  return state.record.revision() + (points > state.record.points() ? 1 : 0);
}

uint64_t NextRevision(const SessionState& state) { return state.record.revision() + 1; }

absl::Status CheckRevision(const SessionState& state, uint64_t points, uint64_t expected) {
  const uint64_t revision = RevisionWith(state, points);
  return expected == 0 || expected == revision
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_REVISION_MISMATCH, absl::StrCat("expected_revision is ", expected, ", but ",
                                                                          state.name(), " is at revision ", revision));
}

absl::Status CheckMesh(const SessionState& state) {
  return state.record.has_mesh() ? absl::OkStatus()
                                 : MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                                             absl::StrCat(state.name(), " has no mesh yet; start a refinement first"));
}

absl::Status CheckSteps(const SessionState& state) {
  WELLSPACE_RETURN_IF_ERROR(CheckMesh(state));
  if (state.record.points_file() > state.record.mesh().revision()) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat("the mesh of ", state.name(),
                                  " is the one from before points were removed; it can be downloaded and located in, "
                                  "and for anything else start a refinement first"));
  }
  if (state.steps.empty()) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat("the mesh of ", state.name(),
                                  " is that of an earlier version of the server, which made other meshes; it can be "
                                  "downloaded, and for anything else start a refinement first"));
  }
  return absl::OkStatus();
}

absl::Status CheckStructure(const SessionState& state, bool has_mesher) {
  WELLSPACE_RETURN_IF_ERROR(CheckSteps(state));
  return has_mesher ? absl::OkStatus()
                    : MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                                absl::StrCat("the structure of ", state.name(),
                                             " was given up in this moment; ask again, and it is built again"));
}

}  // namespace wellspace::server
