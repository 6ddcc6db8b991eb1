#include "server/sessions/refinement.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/mesh/mesh_delta.h"
#include "core/meshers/mesher.h"
#include "server/base/clock.h"
#include "server/jobs/job_size.h"
#include "server/observability/work_observer.h"
#include "server/sessions/progress_pacer.h"
#include "server/sessions/replay.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// From below upwards: StartRefinement and ResumeRefinements submit a job (Submit). On a worker it takes the work
// of the session (Run), has the memory counted (Work) and the mesh made (MakeMesh: MeshFirst, or BringBack and
// MeshAgain), and ends the operation (EndWhenPossible).

// Before the end of an operation is written down again for which the disk had no room.
constexpr absl::Duration kEndRetryDelay = absl::Seconds(1);
// Before an operation comes again that found the queue full, or the store away.
constexpr absl::Duration kResumeRetryDelay = absl::Milliseconds(200);

absl::StatusOr<core::Mesh> MeshFirst(const MesherFactory& create_mesher, const SessionInputs& inputs,
                                     const core::MeshParameters& parameters, core::RunContext& context,
                                     SessionWork& work) {
  std::unique_ptr<core::Mesher> mesher;
  {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> points, inputs.points->CopyFrom(0, context));
    WELLSPACE_ASSIGN_OR_RETURN(mesher, BeginMesh(create_mesher, parameters, points, *inputs.features, context));
  }
  WELLSPACE_RETURN_IF_ERROR(core::ReserveMemory(*mesher, parameters, context));
  WELLSPACE_RETURN_IF_ERROR(mesher->Refine(parameters, context));
  WELLSPACE_ASSIGN_OR_RETURN(core::Mesh mesh, mesher->Extract(parameters.threads, context));
  work.mesher = std::move(mesher);
  return mesh;
}

// Builds the mesher that was given up, if it was. Watchers of the operation see the progress of what it was started for
// alone.
absl::Status BringBack(const MesherFactory& create_mesher, const SessionInputs& inputs, Job& job, SessionWork& work) {
  if (work.mesher == nullptr) {
    job.context().EnterPhase(core::Phase::kTree);
    WELLSPACE_ASSIGN_OR_RETURN(work.mesher, Replay(inputs, *work.mesh, create_mesher, job));
  }
  return absl::OkStatus();
}

// A mesh, and the runs that make its simplices of those of the last one; nothing if these are not known.
struct Updated {
  core::Mesh mesh;
  std::optional<core::MovedRows> simplices{};
};

// `*has_changed`: the mesher may be another than before, on an error too.
absl::StatusOr<Updated> MeshAgain(const SessionInputs& inputs, const core::MeshParameters& parameters,
                                  core::RunContext& context, SessionWork& work, bool* has_changed) {
  context.EnterPhase(core::Phase::kTree);
  WELLSPACE_RETURN_IF_ERROR(work.mesher->CheckFeasible(parameters));
  *has_changed = true;
  if (const absl::Status added =
          AddPointsTo(*work.mesher, *inputs.points, inputs.state->steps.points(), inputs.point_count(), context);
      !added.ok()) {
    *has_changed = false;  // it takes all or none
    return added;
  }
  WELLSPACE_RETURN_IF_ERROR(work.mesher->Refine(parameters, context));
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(work.mesher->memory_bytes() + work.mesh->loaded_bytes()));
  // Downloads may still read the last mesh: the next one is made of a copy.
  WELLSPACE_ASSIGN_OR_RETURN(core::Mesh mesh, work.mesh->Load(context));
  Updated updated{.mesh = std::move(mesh)};
  WELLSPACE_RETURN_IF_ERROR(work.mesher->Update(updated.mesh, parameters.threads, context, &updated.simplices));
  return updated;
}

// The difference from the last mesh to `next`, if clients may want it, and it is small. Null otherwise, and where
// memory does not allow it: they download the mesh then.
std::shared_ptr<DeltaSnapshot> MakeDelta(const Session& session, const SessionInputs& inputs, const Updated& next,
                                         const core::RunContext& context, const SessionWork& work) {
  const MeshSnapshot& last = *work.mesh;
  if (!session.meshes().deltas().IsWanted(last.revision())) {
    return nullptr;
  }
  std::shared_ptr<DeltaSnapshot> made;
  const absl::Status status = RunGuarded([&]() -> absl::Status {
    const uint64_t most = last.loaded_bytes() / 2;  // beyond it, the whole mesh is hardly more
    const core::MovedRows* const simplices = next.simplices.has_value() ? &*next.simplices : nullptr;
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(work.mesher->memory_bytes() + 2 * last.loaded_bytes() +
                                                  core::DeltaScratchBytes(last.record().simplices()) + most));
    WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const core::Mesh> base, last.Whole(context));
    WELLSPACE_ASSIGN_OR_RETURN(const core::MeshDelta delta,
                               core::DiffMeshes(*base, next.mesh, simplices, most, context));
    made = std::make_shared<DeltaSnapshot>(last.revision(), NextRevision(*inputs.state), delta, next.mesh);
    return absl::OkStatus();
  });
  return status.ok() ? made : nullptr;
}

// The results of an operation.
struct Made {
  std::shared_ptr<MeshSnapshot> mesh{};
  std::shared_ptr<DeltaSnapshot> delta{};  // null: none
};

// Has the mesh made, of the session's data; `is_first`: by its points alone. A failure leaves
// nothing behind: a mesher that it has changed is given up, and comes back by Replay.
absl::StatusOr<Made> MakeMesh(const MesherFactory& create_mesher, const Session& session, const SessionInputs& inputs,
                              const core::MeshParameters& parameters, bool is_first, Job& job, SessionWork& work) {
  bool has_changed = is_first;
  const auto make = [&]() -> absl::StatusOr<Updated> {
    if (is_first) {
      work.mesher = nullptr;  // of a restart
      WELLSPACE_ASSIGN_OR_RETURN(core::Mesh mesh, MeshFirst(create_mesher, inputs, parameters, job.context(), work));
      return Updated{.mesh = std::move(mesh)};
    }
    WELLSPACE_RETURN_IF_ERROR(BringBack(create_mesher, inputs, job, work));
    return MeshAgain(inputs, parameters, job.context(), work, &has_changed);
  };
  Made made;
  const absl::Status status = RunGuarded([&] {
    WELLSPACE_ASSIGN_OR_RETURN(Updated next, make());
    has_changed = true;
    if (!is_first) {
      made.delta = MakeDelta(session, inputs, next, job.context(), work);
    }
    WELLSPACE_ASSIGN_OR_RETURN(made.mesh, session.KeepMesh(std::move(next.mesh), job.context()));
    return absl::OkStatus();
  });
  if (status.ok()) {
    return made;
  }
  if (has_changed) {
    work.mesher = nullptr;
  }
  return status;
}

// The same, in the memory of `job`; the part of mesher, mesh and delta is theirs at the end, and the rest is
// released.
absl::StatusOr<Made> Work(const MesherFactory& create_mesher, const Session& session, const SessionInputs& inputs,
                          const core::MeshParameters& parameters, bool is_first, Job& job, SessionWork& work) {
  job.GiveMemory(std::move(work.memory));
  absl::StatusOr<Made> made = MakeMesh(create_mesher, session, inputs, parameters, is_first, job, work);
  if (work.mesher != nullptr) {
    work.memory = job.TakeMemory(work.mesher->memory_bytes());
    work.memory.MakeLasting(inputs.lasts);
  }
  if (made.ok()) {
    MemoryReservation memory = job.TakeMemory(made->mesh->memory_bytes());
    memory.MakeLasting();
    made->mesh->KeepMemory(std::move(memory));
    if (made->delta != nullptr) {
      memory = job.TakeMemory(made->delta->memory_bytes());
      memory.MakeLasting(inputs.lasts);
      made->delta->KeepMemory(std::move(memory));
    }
  }
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();  // clients that see the end may use it at once
  return made;
}

// Ends `operation`, or comes again until there is room on the disk for its end, and a store that takes it.
void EndWhenPossible(const CallEnvironment& environment, const std::shared_ptr<Session>& session,
                     const std::shared_ptr<Operation>& operation, const std::shared_ptr<WorkResult>& result) {
  if (!session->EndWork(*operation, *result)) {
    environment.background.PostAfter(kEndRetryDelay, [&environment, session, operation, result] {
      environment.blocking.Run(session->name(), [&environment, session, operation, result] {
        EndWhenPossible(environment, session, operation, result);
      });
    });
  }
}

void Resume(const CallEnvironment& environment, const ResumedOperation& resumed);

// Of an operation that could not begin: where the store was away, others may still take it, or not.
void TryAgainIfOffered(const CallEnvironment& environment, const std::shared_ptr<Session>& session,
                       const std::shared_ptr<Operation>& operation) {
  if (operation->IsQueued() && session->IsOffered() && !session->IsElsewhere()) {
    environment.background.PostAfter(kResumeRetryDelay, [&environment, session, operation] {
      Resume(environment, {session, operation});
    });
  }
}

void Run(const CallEnvironment& environment, const std::shared_ptr<Session>& session,
         const std::shared_ptr<Operation>& operation, Job& job) {
  const absl::Duration start = SinceBoot();
  if (!operation->SetJob(job.shared_from_this())) {  // that of Submit may come later
    return;
  }
  std::optional<SessionWork> work = session->BeginWork(*operation);
  if (!work.has_value()) {
    TryAgainIfOffered(environment, session, operation);
    return;
  }
  const SessionInputs inputs = session->inputs();
  const SessionSteps& steps = inputs.state->steps;
  const bool is_first = steps.empty() || operation->restart();
  RefinementReport report{
      .operation = operation->name(),
      .tenant = session->tenant(),
      .status = absl::OkStatus(),
      .duration = absl::ZeroDuration(),
      .points = inputs.point_count(),
      .replayed_steps = work->mesher == nullptr && !is_first ? steps.count() : 0,
  };
  const uint64_t vertices_before = is_first ? 0 : work->mesh->record().vertices();
  absl::StatusOr<Made> made = Work(environment.create_mesher, *session, inputs,
                                   inputs.ParametersOf(operation->parameters()), is_first, job, *work);
  report.status = made.status();
  report.duration = SinceBoot() - start;
  if (made.ok()) {
    report.vertices = made->mesh->record().vertices();
    report.simplices = made->mesh->record().simplices();
  } else {
    made = Made();
  }
  const uint64_t new_vertices = report.vertices - std::min(report.vertices, vertices_before);
  environment.observability.work().OnRefinement(report);  // before clients see the end
  const auto result = std::make_shared<WorkResult>(WorkResult{.status = report.status,
                                                              .work = *std::move(work),
                                                              .mesh = std::move(made->mesh),
                                                              .delta = std::move(made->delta),
                                                              .new_vertices = new_vertices,
                                                              .processor_time = job.TakeProcessorTime()});
  EndWhenPossible(environment, session, operation, result);
}

void Tick(Background& background, const std::weak_ptr<Operation>& weak) {
  const std::shared_ptr<Operation> operation = weak.lock();
  if (operation != nullptr && operation->Tick(SinceBoot())) {
    background.PostAfter(ProgressPacer::kMinInterval, [&background, weak] { Tick(background, weak); });
  }
}

// Makes events of the progress of `operation` until its end.
void StartTicking(Background& background, const std::shared_ptr<Operation>& operation) {
  background.Post([&background, weak = std::weak_ptr(operation)] { Tick(background, weak); });
}

// Submits the work of `operation`, which has the session.
absl::StatusOr<std::shared_ptr<Job>> Submit(const CallEnvironment& environment, const std::shared_ptr<Session>& session,
                                            const std::shared_ptr<Operation>& operation) {
  const Session::Size size = session->GetSize(kMostSmallPoints);
  const uint64_t replayed_steps = operation->restart() ? 0 : size.replayed_steps;
  const bool is_small = size.points <= kMostSmallPoints && size.segments <= kMostSmallPoints && size.triangles == 0 &&
                        IsSmallRefinement(session->inputs().ParametersOf(operation->parameters()), size.some_points,
                                          size.vertices, replayed_steps);
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Job> job,
                             environment.jobs.Submit({.tenant = session->tenant(),
                                                      .is_small = is_small,
                                                      .is_alone = operation->RunsAlone(),
                                                      .work = [&environment, session, operation](Job& self) {
                                                        Run(environment, session, operation, self);
                                                      }}));
  if (!operation->SetJob(job)) {
    environment.jobs.Cancel(job);  // the operation, which an earlier process left, was cancelled meanwhile
  }
  return job;
}

// Has the work of an operation of an earlier process done, as soon as there is a place for it.
void Resume(const CallEnvironment& environment, const ResumedOperation& resumed) {
  if (resumed.session->IsElsewhere()) {
    return;
  }
  if (!Submit(environment, resumed.session, resumed.operation).ok()) {
    environment.background.PostAfter(kResumeRetryDelay, [&environment, resumed] { Resume(environment, resumed); });
  }
}

// Calls `then` once, when `operation` has ended.
void WhenEnded(Operation& operation, const std::function<void()>& then) {
  const auto look = [&operation, then, is_done = std::make_shared<std::atomic<bool>>(false)] {
    if (operation.HasEnded() && !is_done->exchange(true)) {
      then();
    }
  };
  operation.Watch(look);
  look();
}

// Operations in whose work one process has died come one after the other: one of them is to blame, and the others are
// not to pay for it a second time. They may, for calls that have come meanwhile and run beside them.
void ResumeNext(const CallEnvironment& environment, const std::shared_ptr<std::deque<ResumedOperation>>& suspects) {
  if (suspects->empty()) {
    return;
  }
  const ResumedOperation next = std::move(suspects->front());
  suspects->pop_front();
  WhenEnded(*next.operation, [&environment, suspects] {
    environment.background.Post([&environment, suspects] { ResumeNext(environment, suspects); });
  });
  Resume(environment, next);
}

}  // namespace

absl::StatusOr<std::shared_ptr<Operation>> StartRefinement(const CallEnvironment& environment,
                                                           const std::shared_ptr<Session>& session,
                                                           const core::MeshParameters& parameters, bool restart,
                                                           uint64_t expected_revision,
                                                           const AnswerTo<v1::Operation>& answer) {
  std::shared_ptr<Job> job;
  const auto submit = [&](const std::shared_ptr<Operation>& operation) {
    WELLSPACE_ASSIGN_OR_RETURN(job, Submit(environment, session, operation));
    return absl::OkStatus();
  };
  absl::StatusOr<std::shared_ptr<Operation>> operation =
      session->StartOperation(parameters, restart, expected_revision, submit, answer);
  if (!operation.ok()) {
    if (job != nullptr) {
      environment.jobs.Cancel(job);
    }
    return operation;
  }
  StartTicking(environment.background, *operation);
  return operation;
}

void ResumeRefinements(const CallEnvironment& environment, std::vector<ResumedOperation> resumed) {
  const auto suspects = std::make_shared<std::deque<ResumedOperation>>();
  // Those that run alone first: nothing has begun yet that they would have to wait for.
  std::ranges::stable_partition(resumed, [](const ResumedOperation& one) { return one.operation->RunsAlone(); });
  for (ResumedOperation& one : resumed) {
    StartTicking(environment.background, one.operation);
    if (one.operation->IsSuspect() && !one.operation->RunsAlone()) {
      suspects->push_back(std::move(one));
    } else {
      Resume(environment, one);
    }
  }
  ResumeNext(environment, suspects);
}

absl::Status CancelOperation(const CallEnvironment& environment, Session& session, Operation& operation) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<Job> job, session.Cancel(operation));
  if (job != nullptr) {
    environment.jobs.Cancel(job);
  }
  return absl::OkStatus();
}

}  // namespace wellspace::server
