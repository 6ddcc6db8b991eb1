#include "server/sessions/session.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
Session::Session(Settings settings, const ServiceOptions& options, MemoryBudget& memory, Clock clock,
                 std::shared_ptr<TenantPoints> tenant_points, SessionLog& log)
    : tenant_(std::move(settings.tenant)),
      name_(std::move(settings.name)),
      dimension_(settings.parameters.dimension),
      create_time_(settings.create_time),
      memory_(memory),
      clock_(std::move(clock)),
      log_(log),
      parameters_(std::move(settings.parameters)),
      labels_(std::move(settings.labels)),
      lease_(settings.ttl, clock_.since_boot()),
      point_account_(name_, dimension_, !log.is_durable(), options, memory, std::move(tenant_points)),
      points_(log.OpenPoints(name_, dimension_, points_file_, {})) {}

core::MeshParameters Session::parameters() const {
  std::lock_guard lock(mutex_);
  return parameters_;
}

v1::Session Session::Describe() const {
  std::lock_guard lock(mutex_);
  return DescribeWithLocked(labels_, lease_.ttl());
}

v1::Session Session::DescribeWithLocked(const std::map<std::string, std::string>& labels, absl::Duration ttl) const {
  v1::Session message;
  message.set_name(name_);
  *message.mutable_create_time() = TimeToProto(create_time_);
  message.set_state(busy_ == Busy::kOperation ? v1::Session::STATE_REFINING
                    : is_ready_               ? v1::Session::STATE_READY
                                              : v1::Session::STATE_OPEN);
  *message.mutable_parameters() = ParametersToProto(parameters_);
  message.mutable_labels()->insert(labels.begin(), labels.end());
  *message.mutable_ttl() = DurationToProto(ttl);
  const absl::Duration since_boot = clock_.since_boot();
  const absl::Duration last_use = lease_.ExpiresAt(since_boot) - lease_.ttl();
  *message.mutable_expire_time() = TimeToProto(clock_.wall() + (last_use + ttl - since_boot));
  message.set_revision(revision_);
  message.set_committed_points(committed_points_);
  message.set_segment_count(feature_summary_.segments);
  message.set_seed_count(feature_summary_.seeds);
  message.set_faces(feature_summary_.faces);
  message.set_crossings(feature_summary_.crossings);
  if (feature_summary_.snap_distance > 0) {
    message.set_snap_distance(feature_summary_.snap_distance);
  }
  message.set_size_count(sizes_in_use_.count);
  if (work_.mesh != nullptr) {
    message.set_vertex_count(work_.mesh->figures().vertices);
    message.set_simplex_count(work_.mesh->figures().simplices);
  }
  message.set_stored_bytes(point_account_.stored_bytes());
  if (!operations_.empty()) {
    message.set_last_operation(operations_.back()->name());
  }
  return message;
}

bool Session::HasLabels(const std::map<std::string, std::string>& labels) const {
  std::lock_guard lock(mutex_);
  return std::all_of(labels.begin(), labels.end(), [this](const auto& label) {
    const auto found = labels_.find(label.first);
    return found != labels_.end() && found->second == label.second;
  });
}

bool Session::Renew() {
  std::lock_guard lock(mutex_);
  return !is_closed_ && lease_.Renew(clock_.since_boot());
}

bool Session::IsExpired() const {
  std::lock_guard lock(mutex_);
  return lease_.HasExpired(clock_.since_boot());
}

absl::Status Session::Update(std::optional<std::map<std::string, std::string>> labels,
                             std::optional<absl::Duration> ttl, uint64_t expected_revision,
                             const AnswerTo<v1::Session>& answer) {
  std::lock_guard change_lock(change_mutex_);
  v1::Session described;
  const absl::Duration next_ttl = ttl.value_or(lease_.ttl());
  {
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
    WELLSPACE_RETURN_IF_ERROR(CheckRevisionLocked(expected_revision));
    described = DescribeWithLocked(labels.value_or(labels_), next_ttl);
  }
  const std::optional<store::v1::AnswerRecord> answer_record = AnswerRecordOf(answer, described);
  WELLSPACE_RETURN_IF_ERROR(CommitState([&](SessionChange& change) {
    *change.state->mutable_labels() = described.labels();
    change.state->set_ttl_ns(absl::ToInt64Nanoseconds(next_ttl));
    change.answer = answer_record;
  }));
  std::lock_guard lock(mutex_);
  if (labels.has_value()) {
    labels_ = *std::move(labels);
  }
  lease_.SetTtl(next_ttl);
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<Operation>> Session::Close(uint64_t expected_revision,
                                                          const std::optional<store::v1::AnswerRecord>& answer) {
  std::lock_guard change_lock(change_mutex_);
  {
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
    WELLSPACE_RETURN_IF_ERROR(CheckRevisionLocked(expected_revision));
  }
  WELLSPACE_RETURN_IF_ERROR(Commit([&](SessionChange& change) {
    change.is_deletion = true;
    change.answer = answer;
  }));
  std::lock_guard lock(mutex_);
  CloseNowLocked();
  return busy_ == Busy::kOperation ? operations_.back() : nullptr;
}

bool Session::CloseIfExpired() {
  std::lock_guard lock(mutex_);
  const bool is_expired = !is_closed_ && lease_.HasExpired(clock_.since_boot());
  if (is_expired) {
    CloseNowLocked();
  }
  return is_expired;
}

void Session::CloseNowLocked() {
  is_closed_ = true;
  point_account_.Close();
}

void Session::BeginBusyLocked(Busy busy) {
  busy_ = busy;
  lease_.BeginUse();
}

void Session::EndBusyLocked() {
  busy_ = Busy::kNo;
  lease_.EndUse(clock_.since_boot());
}

absl::Status Session::CheckOpenLocked() const {
  return is_closed_ ? MakeError(v1::ERROR_REASON_SESSION_NOT_FOUND,
                                absl::StrCat(name_, " does not exist any more: it was deleted, or has expired"))
                    : absl::OkStatus();
}

absl::Status Session::CheckRevisionLocked(uint64_t expected_revision) const {
  return expected_revision == 0 || expected_revision == NextRevisionLocked()
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                         absl::StrCat("expected_revision is ", expected_revision, ", but ", name_, " is at revision ",
                                      NextRevisionLocked()));
}

absl::Status Session::CheckIdleLocked() const {
  switch (busy_) {
    case Busy::kNo:
      return absl::OkStatus();
    case Busy::kStarting:
      return MakeError(v1::ERROR_REASON_SESSION_BUSY, absl::StrCat("an operation of ", name_, " is being started"));
    case Busy::kOperation:
      return MakeError(v1::ERROR_REASON_SESSION_BUSY,
                       absl::StrCat(operations_.back()->name(), " is under way; wait for its end, or cancel it"));
    case Busy::kAddingVertices:
      return MakeError(v1::ERROR_REASON_SESSION_BUSY, absl::StrCat("vertices are being added to ", name_));
    case Busy::kRemovingPoints:
      return MakeError(v1::ERROR_REASON_SESSION_BUSY, absl::StrCat("points are being removed from ", name_));
    case Busy::kReplaying:
      break;
  }
  return MakeError(v1::ERROR_REASON_SESSION_BUSY,
                   absl::StrCat("a query or an addition of vertices has the structure of ", name_,
                                " built again, which was given up; try again later"));
}

absl::Status Session::CheckReadyForChangeLocked(uint64_t expected_revision) const {
  WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
  WELLSPACE_RETURN_IF_ERROR(CheckIdleLocked());
  return CheckRevisionLocked(expected_revision);
}

absl::Status Session::CheckMeshLocked() const {
  return work_.mesh != nullptr ? absl::OkStatus()
                               : MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                                           absl::StrCat(name_, " has no mesh yet; start a refinement first"));
}

absl::Status Session::CheckStepsLocked() const {
  WELLSPACE_RETURN_IF_ERROR(CheckMeshLocked());
  if (points_file_ > work_.mesh->revision()) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat("the mesh of ", name_,
                                  " is the one from before points were removed; it can be downloaded and located in, "
                                  "and for anything else start a refinement first"));
  }
  if (steps_.empty()) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat("the mesh of ", name_,
                                  " is that of an earlier version of the server, which made other meshes; it can be "
                                  "downloaded, and for anything else start a refinement first"));
  }
  return absl::OkStatus();
}

absl::Status Session::CheckStructureLocked() const {
  WELLSPACE_RETURN_IF_ERROR(CheckStepsLocked());
  if (work_.mesher != nullptr) {
    return absl::OkStatus();
  }
  return MakeError(
      v1::ERROR_REASON_MESH_NOT_READY,
      absl::StrCat("the structure of ", name_, " was given up in this moment; ask again, and it is built again"));
}

SessionBox Session::BoxLocked() const {
  return work_.mesh != nullptr
             ? SessionBox{.low = work_.mesh->figures().domain_low, .high = work_.mesh->figures().domain_high}
             : SessionBox{.low = parameters_.domain_low, .high = parameters_.domain_high};
}

std::shared_ptr<const MeshSnapshot> Session::mesh() const {
  std::lock_guard lock(mutex_);
  return work_.mesh;
}

uint64_t Session::NextMeshRevision() const {
  std::lock_guard lock(mutex_);
  return revision_ + 1;  // no other change of it is made while the operation is under way
}

absl::StatusOr<std::shared_ptr<MeshSnapshot>> Session::KeepMesh(core::Mesh mesh,
                                                                const core::RunContext& context) const {
  {
    // Before it is written anywhere. EndWork takes it into the account.
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(
        point_account_.CheckMesh(MeshSnapshot::LoadedBytes(dimension_, mesh.vertex_count(), mesh.simplex_count())));
  }
  return log_.KeepMesh(name_, NextMeshRevision(), std::move(mesh), context);
}

absl::Status Session::Query(uint64_t* version, const std::function<absl::Status(const core::Mesher&)>& query) const {
  std::shared_lock running(queries_mutex_, std::defer_lock);
  const core::Mesher* mesher = nullptr;
  {
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
    WELLSPACE_RETURN_IF_ERROR(CheckIdleLocked());
    WELLSPACE_RETURN_IF_ERROR(CheckStructureLocked());
    if (*version != 0 && *version != structure_version_) {
      return MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                       absl::StrCat(name_, " has changed since the first batch of this call"));
    }
    *version = structure_version_;
    mesher = work_.mesher.get();
    running.lock();  // at once: the session is made busy before anything waits for queries
  }
  return query(*mesher);
}

absl::Status Session::RetryWithRoom(uint64_t bytes, const std::function<absl::Status()>& change) {
  absl::Status made = change();
  return IsMemoryLimit(made) && memory_.CanMakeRoom() && memory_.MakeRoom(bytes, MemoryBudget::Want::kAllOrNothing)
             ? change()
             : made;
}

void Session::NoteIdle() const {
  {
    std::lock_guard lock(mutex_);
    if (!log_.is_durable() || SpareBytesLocked() == 0) {
      return;
    }
  }
  memory_.NoteIdle();
}

std::optional<Session::Spare> Session::GetSpare() const {
  std::lock_guard lock(mutex_);
  const uint64_t bytes = log_.is_durable() ? SpareBytesLocked() : 0;
  if (bytes == 0) {
    return std::nullopt;
  }
  return Spare{.bytes = bytes, .last_use = lease_.ExpiresAt(clock_.since_boot()) - lease_.ttl()};
}

uint64_t Session::SpareBytesLocked() const {
  if (busy_ != Busy::kNo || structure_uses_ > 0) {
    return 0;
  }
  return (work_.mesher == nullptr ? 0 : work_.memory.bytes()) + locator_.SpareBytes() + deltas_.memory_bytes();
}

uint64_t Session::GiveUpMesher() {
  std::unique_ptr<core::Mesher> mesher;
  std::shared_ptr<const LocatedMesh> located;
  std::vector<MeshDeltas::Delta> deltas;
  MemoryReservation memory;
  uint64_t delta_bytes = 0;
  {
    std::lock_guard lock(mutex_);
    std::unique_lock queries(queries_mutex_, std::try_to_lock);  // none can begin without mutex_
    if (!log_.is_durable() || !queries.owns_lock() || SpareBytesLocked() == 0) {
      return 0;
    }
    located = locator_.GiveUp();
    mesher = std::move(work_.mesher);
    memory = std::move(work_.memory);
    delta_bytes = deltas_.memory_bytes();
    deltas = deltas_.GiveUp();
  }
  const uint64_t bytes = memory.bytes() + (located == nullptr ? 0 : located->memory.bytes()) + delta_bytes;
  mesher = nullptr;  // before others may have its memory
  located = nullptr;
  deltas.clear();
  memory.Release();
  return bytes;
}

}  // namespace wellspace::server
