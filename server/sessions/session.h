// A session: a domain, a cloud of points and the mesh over it.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_H_

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/mesher.h"
#include "server/base/clock.h"
#include "server/base/mesh_functions.h"
#include "server/base/options.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/lease.h"
#include "server/sessions/mesh_chunks.h"
#include "server/sessions/operation.h"
#include "server/sessions/point_account.h"
#include "server/sessions/point_store.h"
#include "server/sessions/session_steps.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// The mesh of a session as it was at one revision. Immutable: a download holds it for as long as it wants.
struct MeshSnapshot {
  explicit MeshSnapshot(core::Mesh mesh) : chunks(std::move(mesh)) {}

  uint64_t revision = 0;  // set by the session
  MeshChunks chunks;
};

// What AddVertices did.
struct AddedVertices {
  std::vector<uint32_t> vertices;  // by point
  uint64_t revision = 0;           // of the session
};

// What an operation works on. The session has given it away until the operation has ended.
struct SessionWork {
  std::unique_ptr<core::Mesher> mesher;      // null: there is none yet, or it was given up
  uint64_t meshed_points = 0;                // of the session's points, those that `mesher` has, or would have
  std::shared_ptr<const MeshSnapshot> mesh;  // the last one; null: there is none yet
  MemoryReservation memory;                  // of `mesher`
};

// Thread safety: thread-safe.
// Invariants: (1) revision grows with every change of the points or of the mesh; (2) while an operation is under way,
// or vertices are being added or the mesher is built again, points, mesh, mesher and steps are touched by nothing else;
// (3) what did not succeed leaves the session as it was: structure and mesh are what Replay makes of the steps, whether
// there is a mesher now or not; (4) the lock order is this session's mutex, then that of an operation, of
// TenantPoints or, where memory is released, of the JobPool.
class Session {
 public:
  struct Settings {
    std::string tenant;
    std::string name;  // "sessions/{session}"
    core::MeshParameters parameters;
    std::map<std::string, std::string> labels;
    absl::Duration ttl;
    absl::Time create_time;
  };

  // REQUIRES:   `options` and `memory` outlive this.
  Session(Settings settings, const ServiceOptions& options, MemoryBudget& memory, Clock clock,
          std::shared_ptr<TenantPoints> tenant_points);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const std::string& tenant() const { return tenant_; }
  const std::string& name() const { return name_; }
  int dimension() const { return dimension_; }
  absl::Time create_time() const { return create_time_; }
  core::MeshParameters parameters() const;
  v1::Session Describe() const;
  bool HasLabels(const std::map<std::string, std::string>& labels) const;

  // Renews the lease; false when it has run out already.
  bool Renew();
  // A session with a SessionUse, or with an operation under way, does not expire.
  bool IsExpired() const;

  // Changes what is given.
  //
  // Errors:     REVISION_MISMATCH.
  absl::Status Update(std::optional<std::map<std::string, std::string>> labels, std::optional<absl::Duration> ttl,
                      uint64_t expected_revision);

  // From now on all that changes or asks for points and mesh ends with SESSION_NOT_FOUND. For a session that leaves its
  // store; returns the operation that is under way, which is to be cancelled, or null.
  //
  // Errors:     REVISION_MISMATCH, SESSION_NOT_FOUND (it was closed before): nothing has been done.
  absl::StatusOr<std::shared_ptr<Operation>> Close(uint64_t expected_revision);
  // The same if the lease has run out, so that nothing is under way; says whether it has.
  bool CloseIfExpired();

  // Lets one upload have the session. False: another has it.
  bool BeginUpload();
  void EndUpload();

  // What a client believes that the session has.
  struct Prefix {
    uint64_t first = 0;  // points
    uint64_t end = 0;    // points; first <= end
    uint32_t crc32c = 0;
  };
  // Refuses an upload that goes on where another has ended.
  //
  // Errors:     UPLOAD_GAP, UPLOAD_MISMATCH.
  absl::Status CheckPrefix(const Prefix& prefix) const;

  // Appends those of `coordinates`, whole points of which the first is number `offset` of the session, that it does not
  // have yet; the others have to be those that it has. `expected_revision` 0: any.
  //
  // Errors:     INVALID_CHUNK_SHAPE, INVALID_POINTS, UPLOAD_GAP, UPLOAD_MISMATCH, SESSION_BUSY, TOO_MANY_POINTS,
  //             QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH, SESSION_NOT_FOUND. Nothing has been appended.
  absl::Status Append(uint64_t offset, std::span<const double> coordinates, uint64_t expected_revision);
  // Points and revision, as one.
  v1::UploadPointsResponse Committed() const;

  // The last mesh; null before the first.
  std::shared_ptr<const MeshSnapshot> mesh() const;

  // Has a structure to be queried, or to be added to, on this thread, a worker's: where a mesher was given up, it is
  // built again by `job`. `*is_at_work`: another job does that now, and the status is SESSION_BUSY.
  //
  // Errors:     MESH_NOT_READY, SESSION_BUSY, SESSION_NOT_FOUND, REVISION_MISMATCH; of building it again: MEMORY_LIMIT,
  //             OUT_OF_MEMORY, CANCELLED. It can be tried again.
  absl::Status PrepareStructure(uint64_t expected_revision, const MesherFactory& create_mesher, Job& job,
                                bool* is_at_work = nullptr);

  // What work on the session would have to do with, now.
  struct Size {
    uint64_t points = 0;
    std::vector<double> some_points;  // all, if they are few
    uint64_t vertices = 0;            // of the last mesh
    uint64_t replayed_steps = 0;      // before anything else
  };
  Size GetSize(uint64_t few) const;

  // Runs `query` on this thread, a worker's. Any number of queries run at once. An operation that begins waits for
  // those that run: keep each short (some milliseconds) and ask again for the next batch.
  // `version` is that of the structure: 0 for the first batch, which sets it; for later ones as it was set.
  //
  // Errors:     MESH_NOT_READY, SESSION_BUSY, SESSION_NOT_FOUND; REVISION_MISMATCH when the structure is no longer at
  //             `version`; those of `query`.
  absl::Status Query(uint64_t* version, const std::function<absl::Status(const core::Mesher&)>& query) const;

  // Adds vertices at `points` on this thread, a worker's: all or, on an error, none. `near` has a vertex for each, or
  // is empty.
  //
  // REQUIRES:   PrepareStructure has succeeded; if the mesher was given up since, the error is MESH_NOT_READY.
  // Errors:     MESH_NOT_READY, SESSION_BUSY, INVALID_CHUNK_SHAPE, INVALID_REQUEST (the length of `near`),
  //             INVALID_POINTS, VERTEX_OUT_OF_RANGE, TOO_MANY_POINTS, QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH,
  //             SESSION_NOT_FOUND; CANCELLED.
  absl::StatusOr<AddedVertices> AddVertices(std::span<const double> points, std::span<const uint32_t> near,
                                            uint64_t expected_revision, core::RunContext& context);

  // Begins an operation, whose work the caller is to submit: the session is busy until the operation has ended. If the
  // work cannot be submitted, the caller calls Withdraw.
  //
  // Errors:     SESSION_BUSY, REVISION_MISMATCH, SESSION_NOT_FOUND.
  absl::StatusOr<std::shared_ptr<Operation>> StartOperation(const core::MeshParameters& parameters,
                                                            uint64_t expected_revision);
  // Ends the operation that was started last, whose work was refused with `status`: the session is as it was before,
  // and has no such operation. One that was cancelled in between stays, as cancelled.
  //
  // REQUIRES:   no job works on it.
  void Withdraw(Operation& operation, const absl::Status& status);
  // On the worker, whose job the operation has: what to work on; nothing if the operation has ended before it could
  // begin.
  std::optional<SessionWork> BeginWork(Operation& operation);
  // On the worker: takes back what BeginWork gave, and ends the operation with `status`. `mesh` is the new mesh if that
  // is OK.
  //
  // REQUIRES:   on an error, work.mesher is as it was, or null.
  void EndWork(Operation& operation, const absl::Status& status, SessionWork work, std::shared_ptr<MeshSnapshot> mesh);
  // Ends an operation that still waits for a worker as CANCELLED; false when it does not.
  bool EndWaiting(Operation& operation);

  // Errors:     OPERATION_NOT_FOUND.
  absl::StatusOr<std::shared_ptr<Operation>> FindOperation(const std::string& operation_name) const;
  // Those after number `after`, the oldest first, at most `count`.
  std::vector<std::shared_ptr<Operation>> ListOperations(uint64_t after, size_t count) const;

  // The points. To be called by the operation that is under way.
  const PointStore& points() const { return points_; }
  // What has made the structure. The same.
  const SessionSteps& steps() const { return steps_; }

 private:
  friend class SessionUse;

  // What changes the points or the mesh, and lets nothing else do so.
  enum class Busy { kNo, kOperation, kAddingVertices, kReplaying };

  // The following want mutex_ to be held.
  absl::Status CheckOpen() const;
  absl::Status CheckRevision(uint64_t expected_revision) const;
  absl::Status CheckIdle() const;
  // All three.
  absl::Status CheckReadyForChange(uint64_t expected_revision) const;
  // Whether there is something to query, or to build again.
  absl::Status CheckMesh() const;
  // Whether there is something to query now.
  absl::Status CheckStructure() const;
  // That an upload begins at `offset` with no gap before it.
  absl::Status CheckNoGap(uint64_t offset) const;
  // That `coordinates` are those that the session has from point `first` on.
  absl::Status CheckKnown(uint64_t first, std::span<const double> coordinates) const;
  // Refuses what no mesh of this session could have. `first` is the number of the first point.
  absl::Status CheckCoordinates(uint64_t first, std::span<const double> coordinates) const;
  void CloseNow();
  // The session is the caller's alone until EndBusy, and does not expire.
  void BeginBusy(Busy busy);
  void EndBusy();

  // Without it, once nothing can begin a query any more: waits for those that run.
  void WaitForQueries();
  // Without it, while the mesher is being built again: what it is built by.
  absl::Status Rebuild(const MesherFactory& create_mesher, Job& job);
  // Without it: what AddVertices does before the mesher is touched; keeps others from the session then.
  absl::Status BeginAddition(std::span<const double> points, std::span<const uint32_t> near,
                             uint64_t expected_revision);
  // Without it, while vertices are being added: the part that is the mesher's. `*uploaded` of the points that waited
  // are in it then, on an error too.
  absl::StatusOr<std::vector<uint32_t>> AddToMesher(std::span<const double> points, std::span<const uint32_t> near,
                                                    core::RunContext& context, uint64_t* uploaded);
  // The same: what of AddVertices is wrong before anything is done.
  absl::Status CheckVertices(std::span<const double> points, std::span<const uint32_t> near, uint64_t waiting) const;
  // The same: has room for `count` more vertices in the mesher, or says that there is none.
  absl::Status ReserveForVertices(uint64_t count);

  const std::string tenant_;
  const std::string name_;
  const int dimension_;
  const absl::Time create_time_;
  MemoryBudget& memory_;
  const Clock clock_;

  mutable std::shared_mutex queries_mutex_;  // after mutex_; held shared by queries
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  core::MeshParameters parameters_;  // of the last refinement that succeeded; before it, those of the creation
  std::map<std::string, std::string> labels_;
  Lease lease_;
  bool is_closed_ = false;
  Busy busy_ = Busy::kNo;
  bool is_uploading_ = false;
  bool is_ready_ = false;  // the last operation succeeded, and no points have come since
  uint64_t revision_ = 1;
  PointAccount point_account_;      // with the points that AddVertices is adding
  PointStore points_;               // see invariant (2)
  SessionWork work_;                // its mesher is away while an operation is under way; see invariant (2)
  SessionSteps steps_;              // see invariant (2)
  uint64_t structure_version_ = 0;  // of what queries see; 0: nothing yet
  uint64_t next_operation_ = 1;
  std::deque<std::shared_ptr<Operation>> operations_;  // ascending by number
  std::shared_ptr<Operation> displaced_;  // the one that the last of these has displaced, until its work has begun
};

// Keeps a session from expiring, and renews its lease at the end.
class SessionUse {
 public:
  explicit SessionUse(std::shared_ptr<Session> session);
  ~SessionUse();
  SessionUse(const SessionUse&) = delete;
  SessionUse& operator=(const SessionUse&) = delete;

  Session& session() const { return *session_; }

 private:
  const std::shared_ptr<Session> session_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_H_
