#include "server/sessions/session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr size_t kKeptOperations = 100;

}  // namespace

Session::Session(Settings settings, const ServiceOptions& options, MemoryBudget& memory, Clock clock,
                 std::shared_ptr<TenantPoints> tenant_points)
    : tenant_(std::move(settings.tenant)),
      name_(std::move(settings.name)),
      dimension_(settings.parameters.dimension),
      create_time_(settings.create_time),
      memory_(memory),
      clock_(std::move(clock)),
      parameters_(std::move(settings.parameters)),
      labels_(std::move(settings.labels)),
      lease_(settings.ttl, clock_.since_boot()),
      point_account_(name_, dimension_, options, memory, std::move(tenant_points)) {}

core::MeshParameters Session::parameters() const {
  std::lock_guard lock(mutex_);
  return parameters_;
}

v1::Session Session::Describe() const {
  v1::Session message;
  message.set_name(name_);
  *message.mutable_create_time() = TimeToProto(create_time_);
  std::lock_guard lock(mutex_);
  message.set_state(busy_ == Busy::kOperation ? v1::Session::STATE_REFINING
                    : is_ready_               ? v1::Session::STATE_READY
                                              : v1::Session::STATE_OPEN);
  *message.mutable_parameters() = ParametersToProto(parameters_);
  message.mutable_labels()->insert(labels_.begin(), labels_.end());
  *message.mutable_ttl() = DurationToProto(lease_.ttl());
  const absl::Duration since_boot = clock_.since_boot();
  *message.mutable_expire_time() = TimeToProto(clock_.wall() + (lease_.ExpiresAt(since_boot) - since_boot));
  message.set_revision(revision_);
  message.set_committed_points(points_.coordinate_count() / dimension_);
  message.set_segment_count(features_.segment_count());
  message.set_seed_count(features_.seed_count());
  message.set_faces(features_.face_rule());
  message.set_crossings(features_.crossing_rule());
  if (work_.mesh != nullptr) {
    message.set_vertex_count(work_.mesh->chunks.mesh().vertex_count());
    message.set_simplex_count(work_.mesh->chunks.mesh().simplex_count());
  }
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
                             std::optional<absl::Duration> ttl, uint64_t expected_revision) {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckOpen());
  WELLSPACE_RETURN_IF_ERROR(CheckRevision(expected_revision));
  if (labels.has_value()) {
    labels_ = *std::move(labels);
  }
  if (ttl.has_value()) {
    lease_.SetTtl(*ttl);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<Operation>> Session::Close(uint64_t expected_revision) {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckOpen());
  WELLSPACE_RETURN_IF_ERROR(CheckRevision(expected_revision));
  CloseNow();
  return busy_ == Busy::kOperation ? operations_.back() : nullptr;
}

bool Session::CloseIfExpired() {
  std::lock_guard lock(mutex_);
  const bool is_expired = !is_closed_ && lease_.HasExpired(clock_.since_boot());
  if (is_expired) {
    CloseNow();
  }
  return is_expired;
}

void Session::CloseNow() {
  is_closed_ = true;
  point_account_.Close();
}

void Session::BeginBusy(Busy busy) {
  busy_ = busy;
  lease_.BeginUse();
}

void Session::EndBusy() {
  busy_ = Busy::kNo;
  lease_.EndUse(clock_.since_boot());
}

absl::Status Session::CheckOpen() const {
  return is_closed_ ? MakeError(v1::ERROR_REASON_SESSION_NOT_FOUND,
                                absl::StrCat(name_, " does not exist any more: it was deleted, or has expired"))
                    : absl::OkStatus();
}

absl::Status Session::CheckRevision(uint64_t expected_revision) const {
  return expected_revision == 0 || expected_revision == revision_
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                         absl::StrCat("expected_revision is ", expected_revision, ", but ", name_, " is at revision ",
                                      revision_));
}

absl::Status Session::CheckIdle() const {
  switch (busy_) {
    case Busy::kNo:
      return absl::OkStatus();
    case Busy::kOperation:
      return MakeError(v1::ERROR_REASON_SESSION_BUSY,
                       absl::StrCat(operations_.back()->name(), " is under way; wait for its end, or cancel it"));
    case Busy::kAddingVertices:
      return MakeError(v1::ERROR_REASON_SESSION_BUSY, absl::StrCat("vertices are being added to ", name_));
    case Busy::kReplaying:
      break;
  }
  return MakeError(v1::ERROR_REASON_SESSION_BUSY,
                   absl::StrCat("a query or an addition of vertices has the structure of ", name_,
                                " built again, which an operation without success gave up; try again later"));
}

absl::Status Session::CheckReadyForChange(uint64_t expected_revision) const {
  WELLSPACE_RETURN_IF_ERROR(CheckOpen());
  WELLSPACE_RETURN_IF_ERROR(CheckIdle());
  return CheckRevision(expected_revision);
}

absl::Status Session::CheckMesh() const {
  return work_.mesh != nullptr ? absl::OkStatus()
                               : MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                                           absl::StrCat(name_, " has no mesh yet; start a refinement first"));
}

absl::Status Session::CheckStructure() const {
  WELLSPACE_RETURN_IF_ERROR(CheckMesh());
  if (work_.mesher != nullptr) {
    return absl::OkStatus();
  }
  return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                   absl::StrCat("an operation without success has given up the structure of ", name_,
                                " in this moment; ask again, and it is built again"));
}

absl::Status Session::CheckCoordinates(uint64_t first, std::span<const double> coordinates) const {
  // Before there is a mesh, a domain that was not given grows with the points.
  const std::vector<double>* low = &parameters_.domain_low;
  const std::vector<double>* high = &parameters_.domain_high;
  if (work_.mesh != nullptr) {
    low = &work_.mesh->chunks.mesh().domain_low;
    high = &work_.mesh->chunks.mesh().domain_high;
  }
  int axis = 0;
  for (size_t i = 0; i < coordinates.size(); ++i) {
    const double x = coordinates[i];
    if (low->empty() ? !std::isfinite(x) : !(x >= (*low)[axis] && x <= (*high)[axis])) {
      return MakeError(
          v1::ERROR_REASON_INVALID_POINTS,
          absl::StrCat("points[", first + i / dimension_, "]: coordinate ", axis, " is ", x, "; ",
                       low->empty() ? "a finite number is needed"
                                    : absl::StrCat("in the domain it is from ", (*low)[axis], " to ", (*high)[axis])),
          "points.coordinates");
    }
    axis = axis + 1 == dimension_ ? 0 : axis + 1;
  }
  return absl::OkStatus();
}

bool Session::BeginUpload() {
  std::lock_guard lock(mutex_);
  return !std::exchange(is_uploading_, true);
}

void Session::EndUpload() {
  std::lock_guard lock(mutex_);
  is_uploading_ = false;
}

absl::Status Session::CheckNoGap(uint64_t offset) const {
  return offset <= point_account_.points()
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_GAP,
                         absl::StrCat("point_offset is ", offset, ", but ", name_, " has ", point_account_.points(),
                                      " points; go on at ", point_account_.points(), " or before"),
                         "point_offset");
}

absl::Status Session::CheckPrefix(const Prefix& prefix) const {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckIdle());
  WELLSPACE_RETURN_IF_ERROR(CheckNoGap(prefix.end));
  const uint32_t checksum = points_.Checksum(prefix.first * dimension_, prefix.end * dimension_);
  return checksum == prefix.crc32c
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_MISMATCH,
                         absl::StrCat(name_, " has other points from number ", prefix.first, " up to ", prefix.end,
                                      " than those that this upload goes on after: their checksum is ", checksum,
                                      ", not ", prefix.crc32c, "; add these points at ", point_account_.points(),
                                      ", or to another session"),
                         "checked_crc32c");
}

absl::Status Session::CheckKnown(uint64_t first, std::span<const double> coordinates) const {
  const uint64_t equal = points_.CountEqual(first * dimension_, coordinates);
  if (equal == coordinates.size()) {
    return absl::OkStatus();
  }
  const uint64_t point = first + equal / dimension_;
  return MakeError(v1::ERROR_REASON_UPLOAD_MISMATCH,
                   absl::StrCat("points[", point, "]: coordinate ", equal % dimension_, " is ", coordinates[equal],
                                "; ", name_, " has this point already, with ", points_.at(first * dimension_ + equal),
                                "; send the same again, or add other points at ", point_account_.points()),
                   "points.coordinates");
}

absl::Status Session::Append(uint64_t offset, std::span<const double> coordinates, uint64_t expected_revision) {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckReadyForChange(expected_revision));
  if (coordinates.size() % dimension_ != 0) {
    return MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                     absl::StrCat("the chunk at point ", offset, " has ", coordinates.size(),
                                  " coordinates; expected a multiple of the dimension ", dimension_),
                     "points.coordinates");
  }
  WELLSPACE_RETURN_IF_ERROR(CheckNoGap(offset));
  const uint64_t committed = point_account_.points();
  const uint64_t known = std::min<uint64_t>(committed - offset, coordinates.size() / dimension_);
  WELLSPACE_RETURN_IF_ERROR(CheckKnown(offset, coordinates.first(known * dimension_)));
  coordinates = coordinates.subspan(known * dimension_);
  if (coordinates.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(CheckCoordinates(committed, coordinates));
  WELLSPACE_RETURN_IF_ERROR(point_account_.Take(coordinates.size() / dimension_));
  points_.Append(coordinates);
  is_ready_ = false;
  ++revision_;
  return absl::OkStatus();
}

v1::UploadPointsResponse Session::Committed() const {
  v1::UploadPointsResponse message;
  std::lock_guard lock(mutex_);
  message.set_committed_points(points_.coordinate_count() / dimension_);
  message.set_revision(revision_);
  return message;
}

std::shared_ptr<const MeshSnapshot> Session::mesh() const {
  std::lock_guard lock(mutex_);
  return work_.mesh;
}

absl::Status Session::Query(uint64_t* version, const std::function<absl::Status(const core::Mesher&)>& query) const {
  std::shared_lock running(queries_mutex_, std::defer_lock);
  const core::Mesher* mesher = nullptr;
  {
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpen());
    WELLSPACE_RETURN_IF_ERROR(CheckIdle());
    WELLSPACE_RETURN_IF_ERROR(CheckStructure());
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

absl::StatusOr<std::shared_ptr<Operation>> Session::StartOperation(const core::MeshParameters& parameters,
                                                                   uint64_t expected_revision) {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckReadyForChange(expected_revision));
  if (!features_.IsEmpty()) {
    WELLSPACE_RETURN_IF_ERROR(ValidateForDomain(parameters, features_.View()));
  }
  auto operation = std::make_shared<Operation>(absl::StrCat(name_, "/operations/", next_operation_), next_operation_,
                                               parameters, clock_.wall());
  ++next_operation_;
  BeginBusy(Busy::kOperation);
  operations_.push_back(operation);
  if (operations_.size() > kKeptOperations) {
    displaced_ = std::move(operations_.front());
    operations_.pop_front();
  }
  return operation;
}

void Session::Withdraw(Operation& operation, const absl::Status& status) {
  std::shared_ptr<Operation> withdrawn;  // freed without the lock
  {
    std::lock_guard lock(mutex_);
    if (!operation.IsQueued()) {
      return;
    }
    operation.Fail(clock_.wall(), status);
    withdrawn = std::move(operations_.back());
    operations_.pop_back();
    --next_operation_;
    if (displaced_ != nullptr) {
      operations_.push_front(std::move(displaced_));
    }
    EndBusy();
  }
  operation.Notify();  // others may have found and watched it
}

std::optional<SessionWork> Session::BeginWork(Operation& operation) {
  std::shared_ptr<Operation> displaced;  // freed without the lock
  {
    std::lock_guard lock(mutex_);
    if (!operation.IsQueued()) {
      return std::nullopt;
    }
    operation.Start(clock_.wall());
    displaced = std::move(displaced_);
  }
  WaitForQueries();
  std::lock_guard lock(mutex_);
  return SessionWork{.mesher = std::move(work_.mesher),
                     .meshed_points = work_.meshed_points,
                     .mesh = work_.mesh,
                     .memory = std::move(work_.memory)};
}

void Session::EndWork(Operation& operation, const absl::Status& status, SessionWork work,
                      std::shared_ptr<MeshSnapshot> mesh) {
  {
    std::lock_guard lock(mutex_);
    const absl::Time now = clock_.wall();
    if (status.ok()) {
      mesh->revision = ++revision_;
      work.mesh = std::move(mesh);
      work.meshed_points = points_.coordinate_count() / dimension_;
      steps_.NoteRefinement(work.meshed_points, operation.parameters());
      parameters_ = operation.parameters();
      is_ready_ = true;
      ++structure_version_;
      const core::Mesh& made = work.mesh->chunks.mesh();
      operation.Succeed(now, revision_, made.vertex_count(), made.simplex_count());
    } else {
      operation.Fail(now, status);
      work.meshed_points = steps_.points();
    }
    std::swap(work_, work);  // what was there is freed without the lock
    EndBusy();
  }
  operation.Notify();
}

bool Session::EndWaiting(Operation& operation) {
  std::shared_ptr<Operation> displaced;  // freed without the lock
  {
    std::lock_guard lock(mutex_);
    if (!operation.IsQueued()) {
      return false;
    }
    displaced = std::move(displaced_);
    EndBusy();
    operation.Fail(clock_.wall(), absl::CancelledError("the operation was cancelled"));
  }
  operation.Notify();
  return true;
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

SessionUse::SessionUse(std::shared_ptr<Session> session) : session_(std::move(session)) {
  std::lock_guard lock(session_->mutex_);
  session_->lease_.BeginUse();
}

SessionUse::~SessionUse() {
  std::lock_guard lock(session_->mutex_);
  session_->lease_.EndUse(session_->clock_.since_boot());
}

}  // namespace wellspace::server
