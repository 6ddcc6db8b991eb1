#include "server/sessions/session.h"

#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// The amounts in `state` that count against the limits.
PointAccount::Held HeldBy(const SessionState& state) {
  PointAccount::Held held{
      .points = state.record.points(),
      .features = {
          .segments = state.record.segments(), .triangles = state.record.triangles(), .seeds = state.record.seeds()}};
  for (const SizesInUse& set : UnusedSizes(state, {}, 0)) {  // all of them
    held.sizes += set.count;
  }
  const store::v1::MeshRecord& mesh = state.record.mesh();
  held.mesh_bytes = MeshSnapshot::LoadedBytes(mesh.domain_low_size(), mesh.vertices(), mesh.simplices());
  return held;
}

absl::Duration TtlOf(const SessionState& state) { return absl::Nanoseconds(state.record.ttl_ns()); }

// The description, for clients, of a session that is in `state`, and keeps `stored_bytes`.
v1::Session DescriptionOf(const SessionState& state, const Occupancy& occupancy, const Clock& clock,
                          uint64_t stored_bytes) {
  const store::v1::SessionRecord& record = state.record;
  v1::Session message;
  message.set_name(record.name());
  *message.mutable_create_time() = TimeToProto(absl::FromUnixNanos(record.create_time_ns()));
  message.set_state(occupancy.busy == Busy::kOperation ? v1::Session::STATE_REFINING
                    : record.is_ready()                ? v1::Session::STATE_READY
                                                       : v1::Session::STATE_OPEN);
  *message.mutable_parameters() = record.parameters();
  *message.mutable_labels() = record.labels();
  *message.mutable_ttl() = DurationToProto(TtlOf(state));
  const absl::Duration since_boot = clock.since_boot();
  const absl::Duration last_use = occupancy.lease.ExpiresAt(since_boot) - occupancy.lease.ttl();
  *message.mutable_expire_time() = TimeToProto(clock.wall() + (last_use + TtlOf(state) - since_boot));
  message.set_revision(record.revision());
  message.set_committed_points(record.points());
  message.set_segment_count(record.segments());
  message.set_seed_count(record.seeds());
  message.set_faces(record.faces());
  message.set_crossings(record.crossings());
  if (record.snap_distance() > 0) {
    message.set_snap_distance(record.snap_distance());
  }
  message.set_triangle_count(record.triangles());
  if (record.has_names()) {
    *message.mutable_names() = record.names();
  }
  if (record.has_surface()) {
    *message.mutable_surface() = record.surface();
  }
  message.set_size_count(record.size_count());
  message.set_vertex_count(record.mesh().vertices());
  message.set_simplex_count(record.mesh().simplices());
  message.set_stored_bytes(stored_bytes);
  if (!state.operations.empty()) {
    message.set_last_operation(NameOfOperation(state, state.operations.back()->number()));
  }
  return message;
}

// The file to which this owner appends points.
store::v1::PointsFile NextFile(const SessionState& state) {
  store::v1::PointsFile file;
  file.set_first(state.record.points());
  file.set_number(state.record.revision());
  file.set_epoch(state.epoch);
  return file;
}

// The time that memory is reserved for the mesher of a session.
Lasts LastsIn(const SessionLog& log) { return log.is_durable() ? Lasts::kUntilWanted : Lasts::kSession; }

}  // namespace

absl::StatusOr<std::shared_ptr<Session>> Session::Restore(const StoredSession& stored, const ServiceOptions& options,
                                                          MemoryBudget& memory, Clock clock,
                                                          std::shared_ptr<TenantPoints> tenant_points,
                                                          SessionLog& log) {
  WELLSPACE_ASSIGN_OR_RETURN(SessionState state, StateOf(stored));
  std::deque<std::shared_ptr<Operation>> operations;
  for (const std::shared_ptr<const store::v1::OperationRecord>& record : state.operations) {
    WELLSPACE_ASSIGN_OR_RETURN(core::MeshParameters parameters, ParametersFromRecord(record->parameters()));
    operations.push_back(std::make_shared<Operation>(NameOfOperation(state, record->number()),
                                                     Operation::Resumed(record), std::move(parameters)));
  }
  std::shared_ptr<Session> session(new Session(std::move(state), PointsOf(stored.steps), options, memory,
                                               std::move(clock), std::move(tenant_points), log));
  absl::MutexLock lock(&session->mutex_);
  session->operations_ = std::move(operations);
  if (!session->operations_.empty() && !session->operations_.back()->HasEnded()) {
    session->occupancy_.BeginBusy(Busy::kOperation);
  }
  return session;
}

Session::Session(SessionState state, std::vector<store::v1::StepRecord::Points> committed,
                 const ServiceOptions& options, MemoryBudget& memory, Clock clock,
                 std::shared_ptr<TenantPoints> tenant_points, SessionLog& log)
    : identity_{.tenant = state.record.tenant(),
                .name = state.name(),
                .dimension = state.parameters->dimension,
                .create_time = absl::FromUnixNanos(state.record.create_time_ns())},
      memory_(memory),
      clock_(std::move(clock)),
      log_(log),
      meshes_({.session = name(),
               .are_files = log.is_durable(),
               .lasts = LastsIn(log),
               .check = [this] { return CheckHasMesh(); }}),
      occupancy_{.lease = Lease(TtlOf(state), clock_.since_boot())},
      account_(name(), dimension(), !log.is_durable(), options, memory, std::move(tenant_points)),
      stores_{.dimension = dimension(),
              .file = NextFile(state),
              .points = log.files().OpenPoints({.session = name(),
                                                .dimension = dimension(),
                                                .files = PointsFilesOf(state.record),
                                                .committed = std::move(committed),
                                                .next = NextFile(state)})} {
  const PointAccount::Held held = HeldBy(state);
  stores_.are_loaded = held.features.all() == 0 && held.sizes == 0 && !state.record.has_rules();
  if (state.record.has_mesh()) {
    meshes_.Restore(log_.files().FindMesh(state.record));
  }
  account_.Restore(held);
  state_ = std::make_shared<const SessionState>(std::move(state));
}

// The state to be shown is made before the log has the change: nothing is left then that could fail.
absl::Status Session::Make(SessionChange& change, absl::FunctionRef<void()> also, AnswerOf answer, Survives survives) {
  std::shared_ptr<const SessionState> after;
  WELLSPACE_RETURN_IF_ERROR(RunGuarded([&]() -> absl::Status {
    change_mutex_.AssertHeld();
    WELLSPACE_ASSIGN_OR_RETURN(SessionState applied, Apply(*state(), change));
    if (change.state.has_value()) {
      change.state->set_stored_bytes(PointAccount::StoredBytesOf(HeldBy(applied), dimension()));
      applied.record.set_stored_bytes(change.state->stored_bytes());
    }
    after = std::make_shared<const SessionState>(std::move(applied));
    if (!change.answer.has_value()) {
      change.answer = answer(*after);
    }
    return Commit(change, survives);
  }));
  absl::MutexLock lock(&mutex_);
  state_ = std::move(after);
  occupancy_.lease.SetTtl(TtlOf(*state_));
  occupancy_.is_offered &= change.operations.empty() && !change.is_deletion;
  also();
  return absl::OkStatus();
}

absl::Status Session::Commit(const SessionChange& change, Survives survives) {
  {
    absl::MutexLock lock(&mutex_);
    if (occupancy_.is_elsewhere) {
      return Elsewhere(name());
    }
    if (occupancy_.is_closed) {
      // What was done for a session that was deleted meanwhile was done all the same.
      return change.usage.empty() ? absl::OkStatus()
                                  : log_.Commit({.session = "", .epoch = change.epoch, .usage = change.usage});
    }
  }
  absl::Status committed = log_.Commit(change, survives);
  if (!IsOwnedElsewhere(committed)) {
    return committed;
  }
  NoteElsewhere();
  return Elsewhere(name());
}

void Session::NoteElsewhere(const std::string& address) {
  absl::MutexLock lock(&mutex_);
  occupancy_.is_elsewhere = true;
  if (!address.empty()) {
    occupancy_.owner_address = address;
  }
  occupancy_.is_closed = true;
  account_.Close();
}

std::shared_ptr<const SessionState> Session::state() const {
  absl::MutexLock lock(&mutex_);
  return state_;
}

v1::Session Session::Describe() const {
  absl::MutexLock lock(&mutex_);
  return DescriptionOf(*state_, occupancy_, clock_, account_.stored_bytes());
}

bool Session::Renew() {
  absl::MutexLock lock(&mutex_);
  return !occupancy_.is_closed && occupancy_.lease.Renew(clock_.since_boot());
}

bool Session::IsElsewhere() const {
  absl::MutexLock lock(&mutex_);
  return occupancy_.is_elsewhere;
}

bool Session::IsExpired() const {
  absl::MutexLock lock(&mutex_);
  return occupancy_.lease.HasExpired(clock_.since_boot());
}

absl::Status Session::Update(const std::optional<std::map<std::string, std::string>>& labels,
                             std::optional<absl::Duration> ttl, uint64_t expected_revision,
                             const AnswerTo<v1::Session>& answer) {
  absl::MutexLock change_lock(&change_mutex_);
  {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy_, name()));
    WELLSPACE_RETURN_IF_ERROR(CheckRevision(*state_, stores_.point_count(), expected_revision));
  }
  SessionChange change = UpdateChange(*state(), labels, ttl);
  return Make(
      change, [] {},
      [&](const SessionState& after) {
        v1::Session described;
        {
          absl::MutexLock lock(&mutex_);
          described = DescriptionOf(after, occupancy_, clock_, account_.stored_bytes());
        }
        return AnswerRecordOf(answer, described);
      });
}

absl::StatusOr<std::shared_ptr<Operation>> Session::Close(uint64_t expected_revision,
                                                          const std::optional<store::v1::AnswerRecord>& answer) {
  absl::MutexLock change_lock(&change_mutex_);
  {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy_, name()));
    WELLSPACE_RETURN_IF_ERROR(CheckRevision(*state_, stores_.point_count(), expected_revision));
  }
  SessionChange change = DeletionChange(*state());
  change.answer = answer;
  std::shared_ptr<Operation> under_way;
  WELLSPACE_RETURN_IF_ERROR(Make(change, [&] {
    mutex_.AssertHeld();
    occupancy_.is_closed = true;
    account_.Close();
    under_way = occupancy_.busy == Busy::kOperation ? operations_.back() : nullptr;
  }));
  DropUnnamed();
  return under_way;
}

bool Session::CloseIfExpired() {
  absl::MutexLock lock(&mutex_);
  const bool was_closed = occupancy_.is_closed && !occupancy_.is_elsewhere;
  if (was_closed || !occupancy_.lease.HasExpired(clock_.since_boot())) {
    return false;
  }
  occupancy_.is_closed = true;
  account_.Close();
  return true;
}

absl::Status Session::LogExpiry() {
  absl::MutexLock change_lock(&change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(log_.Commit(DeletionChange(*state())));
  DropUnnamed();
  return absl::OkStatus();
}

void Session::DropUnnamed() {
  store::v1::PointsFile file;
  {
    absl::MutexLock lock(&mutex_);
    file = stores_.file;
  }
  log_.files().DropPoints(name(), file);
}

absl::Status Session::LoadInputs() {
  std::vector<SizesInUse> wanted;
  {
    absl::MutexLock lock(&mutex_);
    if (stores_.are_loaded) {
      return absl::OkStatus();
    }
    // The log has no records any more of a session that was deleted, which would pass for damage.
    WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy_, name()));
    wanted = UnusedSizes(*state_, {}, 0);  // all of them
  }
  WELLSPACE_ASSIGN_OR_RETURN(SizeSets sizes, ReadSizeSets(log_.records(), name(), wanted));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<FeaturePart> parts, log_.records().ReadFeatures(name()));
  const auto features = std::make_shared<FeatureStore>();
  for (const FeaturePart& part : parts) {
    features->Append(part);
  }
  absl::MutexLock lock(&mutex_);
  stores_.features = features;
  stores_.sizes = std::move(sizes);
  stores_.are_loaded = true;
  return absl::OkStatus();
}

SessionInputs Session::inputs() const {
  absl::MutexLock lock(&mutex_);
  return {.state = state_,
          .points = stores_.points,
          .features = stores_.features,
          .sizes = stores_.sizes,
          .lasts = LastsIn(log_)};
}

absl::Status Session::CheckHasMesh() const {
  absl::MutexLock lock(&mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy_, name()));
  return CheckMesh(*state_);
}

absl::StatusOr<std::shared_ptr<MeshSnapshot>> Session::KeepMesh(core::Mesh mesh,
                                                                const core::RunContext& context) const {
  uint64_t revision = 0;
  uint64_t epoch = 0;
  {
    // Before it is written anywhere. EndWork takes it into the account.
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(
        account_.CheckMesh(MeshSnapshot::LoadedBytes(dimension(), mesh.vertex_count(), mesh.simplex_count())));
    revision = NextRevision(*state_);
    epoch = state_->epoch;
  }
  return log_.files().KeepMesh(name(), revision, epoch, std::move(mesh), context);
}

absl::Status Session::Query(uint64_t* version, const std::function<absl::Status(const core::Mesher&)>& query) const {
  const core::Mesher* mesher = nullptr;
  {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckIdle(occupancy_, *state_));
    WELLSPACE_RETURN_IF_ERROR(CheckStructure(*state_, work_.mesher != nullptr));
    if (*version != 0 && *version != state_->structure_version) {
      return MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                       absl::StrCat(name(), " has changed since the first batch of this call"));
    }
    *version = state_->structure_version;
    mesher = work_.mesher.get();
    ++occupancy_.queries;  // whatever wants the structure for itself makes the session busy, and waits
  }
  const auto end = absl::MakeCleanup([this] {
    absl::MutexLock lock(&mutex_);
    --occupancy_.queries;
  });
  return query(*mesher);
}

void Session::NoteIdle() const {
  if (GetSpare().has_value()) {
    memory_.NoteIdle();
  }
}

std::optional<Session::Spare> Session::GetSpare() const {
  absl::MutexLock lock(&mutex_);
  const bool is_idle = log_.is_durable() && occupancy_.IsIdle();
  const uint64_t bytes = meshes_.SpareBytes(is_idle ? SessionMeshes::Part::kAll : SessionMeshes::Part::kEarlier) +
                         (is_idle && work_.mesher != nullptr ? work_.memory.bytes() : 0);
  const Lease& lease = occupancy_.lease;
  return bytes == 0
             ? std::nullopt
             : std::optional(Spare{.bytes = bytes, .last_use = lease.ExpiresAt(clock_.since_boot()) - lease.ttl()});
}

uint64_t Session::GiveUpMemory() {
  SessionWork given_up;
  SessionMeshes::Dropped dropped;
  {
    absl::MutexLock lock(&mutex_);
    const bool is_idle = log_.is_durable() && occupancy_.IsIdle() && occupancy_.queries == 0;
    dropped = meshes_.GiveUp(is_idle ? SessionMeshes::Part::kAll : SessionMeshes::Part::kEarlier);
    if (is_idle) {
      given_up = work_.TakeMesher();
    }
  }
  const uint64_t bytes = dropped.bytes + given_up.memory.bytes();
  given_up.mesher = nullptr;  // before others may have its memory
  given_up.memory.Release();
  return bytes;
}

}  // namespace wellspace::server
