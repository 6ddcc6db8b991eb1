#include "server/sessions/refinement.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/mesher.h"
#include "server/base/clock.h"
#include "server/jobs/job_size.h"
#include "server/observability/work_observer.h"
#include "server/sessions/progress_pacer.h"
#include "server/sessions/replay.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr size_t kCopyBlock = size_t{1} << 20;  // numbers copied between two looks at the context

template <typename T>
absl::StatusOr<core::HugeVector<T>> Copy(const core::HugeVector<T>& values, const core::RunContext& context) {
  core::HugeVector<T> copy;
  copy.reserve(values.size());
  for (size_t begin = 0; begin < values.size(); begin += kCopyBlock) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const T* first = values.data() + begin;
    copy.insert(copy.end(), first, first + std::min(kCopyBlock, values.size() - begin));
  }
  return copy;
}

// Downloads may still read the last mesh: the next one is made of a copy.
absl::StatusOr<core::Mesh> Copy(const core::Mesh& mesh, const core::RunContext& context) {
  core::Mesh copy;
  copy.dimension = mesh.dimension;
  copy.domain_low = mesh.domain_low;
  copy.domain_high = mesh.domain_high;
  copy.statistics = mesh.statistics;
  WELLSPACE_ASSIGN_OR_RETURN(copy.points, Copy(mesh.points, context));
  WELLSPACE_ASSIGN_OR_RETURN(copy.weights, Copy(mesh.weights, context));
  WELLSPACE_ASSIGN_OR_RETURN(copy.simplices, Copy(mesh.simplices, context));
  return copy;  // Update makes the rest anew
}

absl::StatusOr<core::Mesh> MeshFirst(const MesherFactory& create_mesher, const Session& session,
                                     const core::MeshParameters& parameters, core::RunContext& context,
                                     SessionWork& work) {
  std::unique_ptr<core::Mesher> mesher;
  {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> points, session.points().CopyFrom(0, context));
    WELLSPACE_ASSIGN_OR_RETURN(mesher, BeginMesh(create_mesher, parameters, points, session.features(), context));
  }
  WELLSPACE_RETURN_IF_ERROR(core::ReserveMemory(*mesher, parameters, context));
  WELLSPACE_RETURN_IF_ERROR(mesher->Refine(parameters, context));
  WELLSPACE_ASSIGN_OR_RETURN(core::Mesh mesh, mesher->Extract(parameters.threads, context));
  work.mesher = std::move(mesher);
  return mesh;
}

// Builds the mesher that was given up, if it was. Watchers of the operation see the progress of what it was started for
// alone.
absl::Status BringBack(const MesherFactory& create_mesher, const Session& session, Job& job, SessionWork& work) {
  if (work.mesher == nullptr) {
    job.context().EnterPhase(core::Phase::kTree);
    WELLSPACE_ASSIGN_OR_RETURN(work.mesher, Replay(session.steps(), session.points(), session.features(),
                                                   work.mesh->chunks.mesh(), create_mesher, job));
  }
  return absl::OkStatus();
}

// `*has_changed`: the mesher may be another than before, on an error too.
absl::StatusOr<core::Mesh> MeshAgain(const Session& session, const core::MeshParameters& parameters,
                                     core::RunContext& context, SessionWork& work, bool* has_changed) {
  context.EnterPhase(core::Phase::kTree);
  WELLSPACE_RETURN_IF_ERROR(work.mesher->CheckFeasible(parameters));
  {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> points,
                               session.points().CopyFrom(work.meshed_points * parameters.dimension, context));
    *has_changed = true;
    if (const absl::Status added = work.mesher->AddPoints(points, context).status(); !added.ok()) {
      *has_changed = false;  // it takes all or none
      return added;
    }
  }
  WELLSPACE_RETURN_IF_ERROR(work.mesher->Refine(parameters, context));
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(work.mesher->memory_bytes() + work.mesh->chunks.memory_bytes()));
  WELLSPACE_ASSIGN_OR_RETURN(core::Mesh mesh, Copy(work.mesh->chunks.mesh(), context));
  WELLSPACE_RETURN_IF_ERROR(work.mesher->Update(mesh, parameters.threads, context));
  return mesh;
}

// Has the mesh made, by what the session has given for it. What did not succeed leaves nothing behind: a mesher that it
// has changed is given up, and comes back by Replay.
absl::StatusOr<std::shared_ptr<MeshSnapshot>> MakeMesh(const MesherFactory& create_mesher, const Session& session,
                                                       const core::MeshParameters& parameters, Job& job,
                                                       SessionWork& work) {
  bool has_changed = false;
  const auto make = [&]() -> absl::StatusOr<core::Mesh> {
    if (work.mesh == nullptr) {
      return MeshFirst(create_mesher, session, parameters, job.context(), work);
    }
    WELLSPACE_RETURN_IF_ERROR(BringBack(create_mesher, session, job, work));
    return MeshAgain(session, parameters, job.context(), work, &has_changed);
  };
  std::shared_ptr<MeshSnapshot> mesh;
  const absl::Status status = RunGuarded([&] {
    WELLSPACE_ASSIGN_OR_RETURN(core::Mesh made, make());
    mesh = std::make_shared<MeshSnapshot>(std::move(made));
    return absl::OkStatus();
  });
  if (status.ok()) {
    return mesh;
  }
  if (has_changed || work.mesh == nullptr) {
    work.mesher = nullptr;
  }
  return status;
}

// The same, in the memory of `job`; what mesher and mesh have of it is theirs at the end, and the rest is released.
absl::StatusOr<std::shared_ptr<MeshSnapshot>> Work(const MesherFactory& create_mesher, const Session& session,
                                                   const core::MeshParameters& parameters, Job& job,
                                                   SessionWork& work) {
  job.GiveMemory(std::move(work.memory));
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> mesh = MakeMesh(create_mesher, session, parameters, job, work);
  if (work.mesher != nullptr) {
    work.memory = job.TakeMemory(work.mesher->memory_bytes());
    work.memory.MakeLasting();
  }
  if (mesh.ok()) {
    MemoryReservation memory = job.TakeMemory((*mesh)->chunks.memory_bytes());
    memory.MakeLasting();
    (*mesh)->chunks.KeepMemory(std::move(memory));
  }
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();  // clients that see the end may use it at once
  return mesh;
}

void Run(const CallEnvironment& environment, Session& session, Operation& operation, Job& job) {
  const absl::Duration start = SinceBoot();
  operation.SetJob(job.shared_from_this());  // this may come before StartRefinement knows the job
  std::optional<SessionWork> work = session.BeginWork(operation);
  if (!work.has_value()) {
    return;
  }
  RefinementReport report{
      .operation = operation.name(),
      .tenant = session.tenant(),
      .status = absl::OkStatus(),
      .duration = absl::ZeroDuration(),
      .points = session.points().coordinate_count() / operation.parameters().dimension,
      .replayed_steps = work->mesher == nullptr ? session.steps().all().size() : 0,
  };
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> mesh =
      Work(environment.create_mesher, session, operation.parameters(), job, *work);
  report.status = mesh.status();
  report.duration = SinceBoot() - start;
  if (mesh.ok()) {
    report.vertices = (*mesh)->chunks.mesh().vertex_count();
    report.simplices = (*mesh)->chunks.mesh().simplex_count();
  }
  environment.observability.work().OnRefinement(report);  // before clients see the end
  session.EndWork(operation, report.status, *std::move(work), mesh.ok() ? *std::move(mesh) : nullptr);
}

void Tick(Background& background, const std::weak_ptr<Operation>& weak) {
  const std::shared_ptr<Operation> operation = weak.lock();
  if (operation != nullptr && operation->Tick(SinceBoot())) {
    background.PostAfter(ProgressPacer::kMinInterval, [&background, weak] { Tick(background, weak); });
  }
}

}  // namespace

absl::StatusOr<std::shared_ptr<Operation>> StartRefinement(const CallEnvironment& environment,
                                                           const std::shared_ptr<Session>& session,
                                                           const core::MeshParameters& parameters,
                                                           uint64_t expected_revision) {
  const Session::Size size = session->GetSize(kMostPoints);
  const bool is_small = size.points <= kMostPoints && size.segments <= kMostPoints &&
                        IsSmallRefinement(parameters, size.some_points, size.vertices, size.replayed_steps);
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<Operation> operation,
                             session->StartOperation(parameters, expected_revision));
  const absl::StatusOr<std::shared_ptr<Job>> job = environment.jobs.Submit(
      {.tenant = session->tenant(), .is_small = is_small, .work = [&environment, session, operation](Job& self) {
         Run(environment, *session, *operation, self);
       }});
  if (!job.ok()) {
    session->Withdraw(*operation, job.status());
    return job.status();
  }
  if (!operation->SetJob(*job)) {
    environment.jobs.Cancel(*job);  // the operation was cancelled before it had a job, or has ended
  }
  environment.background.Post(
      [&background = environment.background, weak = std::weak_ptr(operation)] { Tick(background, weak); });
  return operation;
}

void CancelOperation(const CallEnvironment& environment, Session& session, Operation& operation) {
  std::shared_ptr<Job> job = operation.job();  // null once it has ended
  if (!session.EndWaiting(operation)) {
    job = operation.job();  // it may have begun meanwhile, before StartRefinement knew its job
  }
  if (job != nullptr) {
    environment.jobs.Cancel(job);
  }
}

}  // namespace wellspace::server
