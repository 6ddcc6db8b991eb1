// What a session does with its structure: has it built again, and adds vertices to it.
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
  {
    std::lock_guard change_lock(change_mutex_);
    WELLSPACE_RETURN_IF_ERROR(LoadInputs());
    std::lock_guard lock(mutex_);
    if (is_at_work != nullptr) {
      *is_at_work = busy_ == Busy::kReplaying && !is_closed_;
    }
    WELLSPACE_RETURN_IF_ERROR(CheckReadyForChangeLocked(expected_revision));
    WELLSPACE_RETURN_IF_ERROR(CheckStepsLocked());
    if (work_.mesher != nullptr) {
      return absl::OkStatus();
    }
    BeginBusyLocked(Busy::kReplaying);
  }
  const absl::Status status = RunGuarded([&] { return Rebuild(create_mesher, job); });
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();
  {
    std::lock_guard lock(mutex_);
    EndBusyLocked();
  }
  NoteIdle();
  return status;
}

Session::Size Session::GetSize(uint64_t few) const {
  std::lock_guard lock(mutex_);
  Size size;
  size.points = PointCountLocked();
  size.segments = feature_summary_.segments;
  if (size.points <= few) {
    size.some_points = points_->CopyFrom(0, core::RunContext()).value_or(std::vector<double>());
  }
  if (work_.mesh != nullptr) {
    size.vertices = work_.mesh->figures().vertices;
    // While vertices are added, or points removed, the mesher is theirs, and not looked at.
    const bool may_look = busy_ == Busy::kNo || busy_ == Busy::kStarting || busy_ == Busy::kOperation;
    const bool is_given_up = busy_ == Busy::kReplaying || (may_look && work_.mesher == nullptr);
    size.replayed_steps = is_given_up ? steps_.all().size() : 0;
  }
  return size;
}

absl::Status Session::Rebuild(const MesherFactory& create_mesher, Job& job) {
  WELLSPACE_ASSIGN_OR_RETURN(work_.mesher, Replay(steps_, *points_, features_, *work_.mesh, create_mesher, job));
  work_.memory = job.TakeMemory(work_.mesher->memory_bytes());
  work_.memory.MakeLasting(MesherLasts());
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<const MeshSnapshot>> Session::MeshAt(uint64_t revision) const {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
  WELLSPACE_RETURN_IF_ERROR(CheckMeshLocked());
  if (revision != 0 && revision != work_.mesh->revision()) {
    return MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                     absl::StrCat("revision is ", revision, ", but the mesh of ", name_, " is of revision ",
                                  work_.mesh->revision()));
  }
  return work_.mesh;
}

bool Session::HasLocator() const {
  std::lock_guard lock(mutex_);
  return work_.mesh != nullptr && locator_.Has(work_.mesh->revision());
}

absl::StatusOr<std::shared_ptr<const LocatedMesh>> Session::PrepareLocator(uint64_t revision, Job& job) {
  return locator_.Prepare([&] { return MeshAt(revision); }, MesherLasts(), job);
}

void Session::WaitForQueries() { std::unique_lock wait(queries_mutex_); }

absl::Status Session::BeginAddition(std::span<const double> points, std::span<const uint32_t> near,
                                    uint64_t expected_revision) {
  std::lock_guard change_lock(change_mutex_);
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckReadyForChangeLocked(expected_revision));
  WELLSPACE_RETURN_IF_ERROR(CheckStructureLocked());
  if (points.size() % dimension_ != 0) {
    return MakeError(
        v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
        absl::StrCat("there are ", points.size(), " coordinates; expected a multiple of the dimension ", dimension_),
        "points");
  }
  if (!near.empty() && near.size() != points.size() / dimension_) {
    return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                     absl::StrCat("near has ", near.size(), " vertices for ", points.size() / dimension_,
                                  " points; expected as many, or none"),
                     "near");
  }
  WELLSPACE_RETURN_IF_ERROR(point_account_.Take(points.size() / dimension_));
  BeginBusyLocked(Busy::kAddingVertices);
  return absl::OkStatus();
}

absl::StatusOr<AddedVertices> Session::AddVertices(std::span<const double> points, std::span<const uint32_t> near,
                                                   uint64_t expected_revision, core::RunContext& context,
                                                   const AnswerTo<AddedVertices>& answer) {
  WELLSPACE_RETURN_IF_ERROR(BeginAddition(points, near, expected_revision));
  WaitForQueries();
  uint64_t uploaded = 0;
  bool has_returned = false;
  AddedVertices added;
  absl::Status status = RunGuarded([&] {
    absl::StatusOr<std::vector<uint32_t>> vertices = AddToMesher(points, near, context, &uploaded);
    has_returned = true;
    WELLSPACE_ASSIGN_OR_RETURN(added.vertices, std::move(vertices));
    return absl::OkStatus();
  });
  if (!has_returned || (!status.ok() && uploaded > 0)) {
    // An exception leaves a mesher in an unknown state; else points that waited are in it, which would come with
    // others.
    DropMesher();
  } else if (memory_.is_limited()) {
    // What was reserved is more than was needed but for the most uneven points; those are counted by the next
    // refinement.
    (void)work_.memory.Resize(work_.mesher->memory_bytes());
  }
  if (status.ok()) {
    status = RunGuarded([&] { return CommitAddition(points, uploaded, answer, &added); });
    if (!status.ok()) {
      DropMesher();  // it has them
    }
  }
  {
    std::lock_guard lock(mutex_);
    EndBusyLocked();
    if (!status.ok()) {
      point_account_.Return(points.size() / dimension_);
    }
  }
  NoteIdle();
  if (!status.ok()) {
    return status;
  }
  return added;
}

void Session::DropMesher() {
  work_.mesher = nullptr;
  work_.memory.Release();
}

absl::Status Session::CommitAddition(std::span<const double> points, uint64_t uploaded,
                                     const AnswerTo<AddedVertices>& answer, AddedVertices* added) {
  // Of a session that is busy, what is read here changes with change_mutex_ held alone: by an upload that ends.
  std::lock_guard change_lock(change_mutex_);
  const uint64_t count = points.size() / dimension_;
  if (uploaded == 0 && count == 0) {
    added->revision = revision_;
    return absl::OkStatus();
  }
  const uint64_t known = PointCountLocked();
  const uint64_t uploads_end = work_.meshed_points + uploaded;
  const bool grows = known + count > committed_points_;
  added->revision = revision_ + (grows ? 1 : 0);
  const std::optional<store::v1::AnswerRecord> answer_record = AnswerRecordOf(answer, *added);
  const absl::Status status = RunGuarded([&]() -> absl::Status {
    {
      std::lock_guard lock(mutex_);
      WELLSPACE_RETURN_IF_ERROR(points_->Append(points));
    }
    if (grows) {
      WELLSPACE_RETURN_IF_ERROR(points_->Synchronize());
    }
    return CommitState([&](SessionChange& change) {
      if (grows) {
        AddPointsTo(change, known + count, ExtendCrc32c(uncommitted_crc32c_, points.data(), points.size_bytes()));
      }
      store::v1::StepRecord::Added& step = *change.steps.emplace_back().mutable_added();
      step.set_uploads_end(uploads_end);
      step.set_end(uploads_end + count);
      change.answer = answer_record;
    });
  });
  std::lock_guard lock(mutex_);
  if (!status.ok()) {
    points_->Truncate(known * dimension_);
    return status;
  }
  steps_.NoteAddition(uploads_end, uploads_end + count);
  work_.meshed_points = steps_.points();
  ++structure_version_;
  if (grows) {
    uncommitted_crc32c_ = 0;
    NotePointsLocked(known + count);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<uint32_t>> Session::AddToMesher(std::span<const double> points,
                                                           std::span<const uint32_t> near, core::RunContext& context,
                                                           uint64_t* uploaded) {
  WELLSPACE_RETURN_IF_ERROR(ReserveForVertices(point_account_.points() - work_.meshed_points, memory_, work_));
  // Points that were uploaded since the last refinement come first: they have lower numbers.
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> waiting,
                             points_->CopyFrom(work_.meshed_points * dimension_, context));
  if (!waiting.empty()) {
    // What is wrong with the vertices shows before the mesher has taken in others, which would cost it.
    WELLSPACE_RETURN_IF_ERROR(CheckNear(near, *work_.mesher, waiting.size() / dimension_));
    WELLSPACE_RETURN_IF_ERROR(CheckPoints(BoxLocked(), dimension_, 0, points));
    WELLSPACE_RETURN_IF_ERROR(work_.mesher->AddPoints(waiting, context).status());
    *uploaded = waiting.size() / dimension_;
  }
  absl::StatusOr<std::vector<uint32_t>> added = work_.mesher->AddPointsNear(points, near, context);
  if (added.status().code() == absl::StatusCode::kOutOfRange) {
    return MakeError(v1::ERROR_REASON_VERTEX_OUT_OF_RANGE, std::string(added.status().message()), "near");
  }
  return added;
}

}  // namespace wellspace::server
