// Methods of Session about its structure: they have it built again, and add vertices to it.
#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"
#include "server/sessions/replay.h"
#include "server/sessions/session.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Whether a cut is one with these options.
auto IsCutWith(const core::PartitionOptions& options) {
  return [&options](const MeshCut& cut) {
    return cut.options.parts == options.parts && cut.options.contiguous == options.contiguous;
  };
}

// Reserves memory for `count` more vertices in the mesher of `work`.
absl::Status ReserveForVertices(uint64_t count, MemoryBudget& memory, SessionWork& work) {
  if (!memory.is_limited()) {
    return absl::OkStatus();
  }
  const uint64_t wanted = BytesWithVertices(*work.mesher, count);
  if (work.memory.Resize(wanted) ||
      (memory.MakeRoom(wanted - std::min(wanted, work.memory.bytes()), MemoryBudget::Want::kAllOrNothing) &&
       work.memory.Resize(wanted))) {
    return absl::OkStatus();
  }
  return memory.Refusal(wanted, "the vertices of a session");
}

// Refuses vertices `near` that `mesher` does not have even when it has taken in `waiting` points.
absl::Status CheckNear(std::span<const uint32_t> near, const core::Mesher& mesher, uint64_t waiting) {
  const uint64_t most = mesher.vertex_count() + waiting;
  const auto missing = std::ranges::find_if(near, [most](uint32_t vertex) { return vertex >= most; });
  return missing == near.end() ? absl::OkStatus()
                               : MakeError(v1::ERROR_REASON_VERTEX_OUT_OF_RANGE,
                                           absl::StrCat("near[", missing - near.begin(), "] is ", *missing,
                                                        ", and no vertex; there are ", mesher.vertex_count()),
                                           "near");
}

}  // namespace

absl::Status Session::PrepareStructure(uint64_t expected_revision, const MesherFactory& create_mesher, Job& job,
                                       bool* is_at_work) {
  std::shared_ptr<const MeshSnapshot> last_mesh;
  {
    absl::MutexLock change_lock(&change_mutex_);
    WELLSPACE_RETURN_IF_ERROR(LoadInputs());
    absl::MutexLock lock(&mutex_);
    if (is_at_work != nullptr) {
      *is_at_work = occupancy_.busy == Busy::kReplaying && !occupancy_.is_closed;
    }
    WELLSPACE_RETURN_IF_ERROR(CheckReady(occupancy_, *state_, stores_.point_count(), expected_revision));
    WELLSPACE_RETURN_IF_ERROR(CheckSteps(*state_));
    if (work_.mesher != nullptr) {
      return absl::OkStatus();
    }
    occupancy_.BeginBusy(Busy::kReplaying);
    last_mesh = work_.mesh;
  }
  SessionWork built;
  const absl::Status status = RunGuarded([&] {
    const SessionInputs inputs = this->inputs();
    WELLSPACE_ASSIGN_OR_RETURN(built.mesher, Replay(inputs, *last_mesh, create_mesher, job));
    built.memory = job.TakeMemory(built.mesher->memory_bytes());
    built.memory.MakeLasting(inputs.lasts);
    return absl::OkStatus();
  });
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();
  {
    absl::MutexLock lock(&mutex_);
    work_.mesher = std::move(built.mesher);
    work_.memory = std::move(built.memory);
    occupancy_.EndBusy(clock_.since_boot());
  }
  NoteIdle();
  return status;
}

Session::Size Session::GetSize(uint64_t few) const {
  absl::MutexLock lock(&mutex_);
  Size size;
  size.points = stores_.point_count();
  size.segments = state_->record.segments();
  size.triangles = state_->record.triangles();
  if (size.points <= few) {
    size.some_points = stores_.points->CopyFrom(0, core::RunContext()).value_or(std::vector<double>());
  }
  if (CheckMesh(*state_).ok()) {
    size.vertices = state_->record.mesh().vertices();
    // While vertices are added, or points removed, the mesher is theirs, and not looked at.
    const bool is_theirs = occupancy_.busy == Busy::kAddingVertices || occupancy_.busy == Busy::kRemovingPoints;
    size.replayed_steps = !is_theirs && work_.mesher == nullptr ? state_->steps.count() : 0;
  }
  return size;
}

absl::StatusOr<std::shared_ptr<const LocatedMesh>> Session::PrepareLocator(uint64_t revision, Job& job) {
  absl::StatusOr<std::shared_ptr<const MeshSnapshot>> earlier = nullptr;
  {
    absl::MutexLock lock(&mutex_);
    if (!occupancy_.is_closed && earlier_mesh_ != nullptr && earlier_mesh_->revision() == revision) {
      earlier = earlier_mesh_;
    }
  }
  const Lasts lasts = inputs().lasts;
  const auto make = [&](const MeshSnapshot& found) { return MakeLocated(found, lasts, job); };
  if (*earlier != nullptr) {
    return earlier_locator_.Prepare([&] { return earlier; }, make);
  }
  const auto mesh = [&]() -> absl::StatusOr<std::shared_ptr<const MeshSnapshot>> {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy_, name()));
    WELLSPACE_RETURN_IF_ERROR(CheckMesh(*state_));
    if (revision != 0 && earlier_mesh_ != nullptr && revision == earlier_mesh_->revision()) {
      return earlier_mesh_;  // it was the last one before the wait
    }
    if (revision != 0 && revision != work_.mesh->revision()) {
      const std::string kept =
          earlier_mesh_ == nullptr ? "" : absl::StrCat(", and the one that is kept, of ", earlier_mesh_->revision());
      return MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                       absl::StrCat("revision is ", revision, ", but the mesh of ", name(), " is of revision ",
                                    work_.mesh->revision(), kept),
                       "revision");
    }
    return work_.mesh;
  };
  absl::StatusOr<std::shared_ptr<const LocatedMesh>> located = locator_.Prepare(mesh, make);
  return located.ok() ? std::move(located) : ErrorOfFile(located.status());
}

absl::StatusOr<std::shared_ptr<const MeshCut>> Session::PrepareCut(const std::shared_ptr<const MeshSnapshot>& mesh,
                                                                   const core::PartitionOptions& options, Job& job,
                                                                   bool* is_at_work) {
  const auto find = [&]() -> absl::StatusOr<std::shared_ptr<const MeshSnapshot>> {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy_, name()));
    return mesh;
  };
  const Lasts lasts = inputs().lasts;
  absl::StatusOr<std::shared_ptr<const MeshCut>> cut = cuts_.Prepare(
      find, [&](const MeshSnapshot& found) { return CutIntoParts(found, options, lasts, job); }, IsCutWith(options),
      is_at_work);
  return cut.ok() ? std::move(cut) : ErrorOfFile(cut.status());
}

bool Session::HasCut(const MeshSnapshot& mesh, const core::PartitionOptions& options) const {
  return cuts_.Find(mesh.revision(), IsCutWith(options)) != nullptr;
}

bool Session::HasLocator(uint64_t revision) const {
  absl::MutexLock lock(&mutex_);
  const uint64_t last = work_.mesh == nullptr ? 0 : work_.mesh->revision();
  return last != 0 &&
         (locator_.Find(revision == 0 ? last : revision) != nullptr || earlier_locator_.Find(revision) != nullptr);
}

// One AddVertices: its parts, in their order.
class VertexAddition {
 public:
  VertexAddition(Session& session, std::span<const double> points, std::span<const uint32_t> near)
      : session_(session), points_(points), near_(near), count_(points.size() / session.dimension()) {}

  // Checks the request, takes the mesher, and makes the session Busy::kAddingVertices.
  absl::Status Begin(uint64_t expected_revision);
  // Has the mesher take the points in, and commits that. On an error the session is as it was; a mesher that has
  // more is given up.
  absl::StatusOr<AddedVertices> Add(core::RunContext& context, const AnswerTo<AddedVertices>& answer);
  // The session is free again; `is_made`: whether Add succeeded.
  void End(bool is_made);

 private:
  // The part that the mesher does. First it takes in the points that were uploaded since it was last refined.
  absl::StatusOr<std::vector<uint32_t>> AddToMesher(core::RunContext& context);
  // The log has them then.
  absl::Status Commit(const AnswerTo<AddedVertices>& answer, AddedVertices* added);
  void DropMesher() {
    work_.mesher = nullptr;
    work_.memory.Release();
  }

  Session& session_;
  const std::span<const double> points_;
  const std::span<const uint32_t> near_;
  const uint64_t count_;
  SessionWork work_;
  uint64_t uploaded_ = 0;  // points that came by uploads, and were taken in
};

absl::Status VertexAddition::Begin(uint64_t expected_revision) {
  absl::MutexLock change_lock(&session_.change_mutex_);
  absl::MutexLock lock(&session_.mutex_);
  const int dimension = session_.dimension();
  WELLSPACE_RETURN_IF_ERROR(
      CheckReady(session_.occupancy_, *session_.state_, session_.stores_.point_count(), expected_revision));
  WELLSPACE_RETURN_IF_ERROR(CheckStructure(*session_.state_, session_.work_.mesher != nullptr));
  if (points_.size() % dimension != 0) {
    return MakeError(
        v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
        absl::StrCat("there are ", points_.size(), " coordinates; expected a multiple of the dimension ", dimension),
        "points");
  }
  if (!near_.empty() && near_.size() != count_) {
    return MakeError(
        v1::ERROR_REASON_INVALID_REQUEST,
        absl::StrCat("near has ", near_.size(), " vertices for ", count_, " points; expected as many, or none"),
        "near");
  }
  WELLSPACE_RETURN_IF_ERROR(session_.account_.Take(count_));
  session_.occupancy_.BeginBusy(Busy::kAddingVertices);
  session_.mutex_.Await(absl::Condition(HasNoQueries, &session_.occupancy_));
  work_ = session_.work_.TakeMesher();
  return absl::OkStatus();
}

absl::StatusOr<AddedVertices> VertexAddition::Add(core::RunContext& context, const AnswerTo<AddedVertices>& answer) {
  bool has_returned = false;
  AddedVertices added;
  absl::Status status = RunGuarded([&] {
    absl::StatusOr<std::vector<uint32_t>> vertices = AddToMesher(context);
    has_returned = true;
    WELLSPACE_ASSIGN_OR_RETURN(added.vertices, std::move(vertices));
    return absl::OkStatus();
  });
  if (!has_returned || (!status.ok() && uploaded_ > 0)) {
    // An exception leaves a mesher in an unknown state; else points that waited are in it, which would come with
    // others.
    DropMesher();
  } else if (session_.memory_.is_limited()) {
    // The reservation is larger than the need, but for the most uneven points; those are counted by the next
    // refinement.
    (void)work_.memory.Resize(work_.mesher->memory_bytes());
  }
  if (status.ok()) {
    status = RunGuarded([&] { return Commit(answer, &added); });
    if (!status.ok()) {
      DropMesher();  // it has them
    }
  }
  if (!status.ok()) {
    return status;
  }
  return added;
}

absl::StatusOr<std::vector<uint32_t>> VertexAddition::AddToMesher(core::RunContext& context) {
  const SessionInputs inputs = session_.inputs();
  const uint64_t meshed = inputs.state->steps.points();
  core::Mesher& mesher = *work_.mesher;
  WELLSPACE_RETURN_IF_ERROR(ReserveForVertices(inputs.point_count() + count_ - meshed, session_.memory_, work_));
  // Points that were uploaded since the last refinement come first: they have lower numbers.
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> waiting,
                             inputs.points->CopyFrom(meshed * session_.dimension(), context));
  if (!waiting.empty()) {
    // Bad vertices are refused before the mesher takes in the uploads: an error after that costs the mesher.
    WELLSPACE_RETURN_IF_ERROR(CheckNear(near_, mesher, waiting.size() / session_.dimension()));
    WELLSPACE_RETURN_IF_ERROR(CheckPoints(BoxOf(*inputs.state), session_.dimension(), 0, points_));
    WELLSPACE_RETURN_IF_ERROR(mesher.AddPoints(waiting, context).status());
    uploaded_ = waiting.size() / session_.dimension();
  }
  absl::StatusOr<std::vector<uint32_t>> added = mesher.AddPointsNear(points_, near_, context);
  if (added.status().code() == absl::StatusCode::kOutOfRange) {
    return MakeError(v1::ERROR_REASON_VERTEX_OUT_OF_RANGE, std::string(added.status().message()), "near");
  }
  return added;
}

absl::Status VertexAddition::Commit(const AnswerTo<AddedVertices>& answer, AddedVertices* added) {
  absl::MutexLock change_lock(&session_.change_mutex_);
  const std::shared_ptr<const SessionState> before = session_.state();
  added->revision = before->record.revision();
  if (uploaded_ == 0 && count_ == 0) {
    return absl::OkStatus();
  }
  SessionChange change;
  std::shared_ptr<PointStore> store;
  uint64_t known = 0;
  {
    absl::MutexLock lock(&session_.mutex_);
    store = session_.stores_.points;
    known = session_.stores_.point_count();
    const uint32_t crc32c = ExtendCrc32c(session_.stores_.new_crc32c, points_.data(), points_.size_bytes());
    change = AdditionChange(*before, {.end = known + count_, .crc32c = crc32c, .file = session_.stores_.file},
                            before->steps.points() + uploaded_, count_);
    added->revision = change.state->revision();
  }
  change.answer = AnswerRecordOf(answer, *added);
  const absl::Status status = RunGuarded([&]() -> absl::Status {
    {
      absl::MutexLock lock(&session_.mutex_);
      WELLSPACE_RETURN_IF_ERROR(store->Append(points_));
    }
    if (change.state->points() > before->record.points()) {
      WELLSPACE_RETURN_IF_ERROR(store->Synchronize());
    }
    session_.change_mutex_.AssertHeld();
    return session_.Make(change, [&] {
      session_.mutex_.AssertHeld();
      session_.stores_.new_crc32c = 0;
    });
  });
  if (!status.ok()) {
    absl::MutexLock lock(&session_.mutex_);
    store->Truncate(known * session_.dimension());
  }
  return status;
}

void VertexAddition::End(bool is_made) {
  {
    absl::MutexLock lock(&session_.mutex_);
    session_.work_.mesher = std::move(work_.mesher);
    session_.work_.memory = std::move(work_.memory);
    if (!is_made) {
      session_.account_.Return(count_);
    }
    session_.occupancy_.EndBusy(session_.clock_.since_boot());
  }
  session_.NoteIdle();
}

absl::StatusOr<AddedVertices> Session::AddVertices(std::span<const double> points, std::span<const uint32_t> near,
                                                   uint64_t expected_revision, core::RunContext& context,
                                                   const AnswerTo<AddedVertices>& answer) {
  VertexAddition addition(*this, points, near);
  WELLSPACE_RETURN_IF_ERROR(addition.Begin(expected_revision));
  absl::StatusOr<AddedVertices> added = addition.Add(context, answer);
  addition.End(added.ok());
  return added;
}

}  // namespace wellspace::server
