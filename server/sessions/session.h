// A session: a domain, its points, segments and sizes, and the mesh over them.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_H_

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/meshers/mesher.h"
#include "server/base/clock.h"
#include "server/base/mesh_functions.h"
#include "server/base/options.h"
#include "server/inputs/feature_store.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/answer_to.h"
#include "server/sessions/occupancy.h"
#include "server/sessions/operation.h"
#include "server/sessions/point_account.h"
#include "server/sessions/session_changes.h"
#include "server/sessions/session_inputs.h"
#include "server/sessions/session_meshes.h"
#include "server/sessions/session_state.h"
#include "server/sessions/session_work.h"
#include "server/store/mesh_snapshot.h"
#include "server/store/point_store.h"
#include "server/store/session_log.h"
#include "wellspace/store/v1/records.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// The result of AddVertices.
struct AddedVertices {
  std::vector<uint32_t> vertices;  // by point
  uint64_t revision = 0;           // of the session
};

// The result of RemovePoints.
struct PointsLeft {
  uint64_t points = 0;
  uint64_t revision = 0;  // of the session
};

// A session in the process that has it: its state, which is a value (session_state.h), and the process's own data
// beside it: stores of points, features and sizes, the mesher, the meshes and their products (session_meshes.h), live
// operations, and who is at work (occupancy.h).
//
// A change is made by a pure function of the state and of the request (session_changes.h); Make applies it, has
// the log commit it, and shows the state after it. Functions are in several files:
//
//   session.cc             description, labels, lease and end; queries; the mesher that is given up; Make
//   session_points.cc      uploads                           session_features.cc    features
//   session_removal.cc     points that are taken out         session_operations.cc  operations
//   session_sizes.cc       sizes at points                   session_structure.cc   the mesher that is built again,
//   session_offers.cc      operations for other servers                             vertices that are added
//
// States, and their changes: docs/design/sessions.md, "States".
//
// Thread safety: thread-safe. Functions that change the session wait for the log: they are to be called where that
//                holds up no other work.
// Invariants: (1) the state is Apply of the whole log; (2) while the session is busy, only the work that made it so
//             touches points, features, sizes, mesh, mesher and steps; (3) a failed change leaves the session as it
//             was: structure and mesh are as Replay makes them of the steps, with or without a mesher; (4) no client is
//             told of a change, and nothing shows it, before the log has it; a change that it cannot have is not made.
//             An expiry and the end of an operation show even where it cannot have them.
class Session {
 public:
  // A session that is written down as `stored`: without mesher, its files not looked at yet. Its lease begins now. An
  // operation that had not ended waits for a worker again.
  //
  // REQUIRES:   `options`, `memory` and `log` outlive it.
  // Errors:     those of parameters that this server does not know any more.
  static absl::StatusOr<std::shared_ptr<Session>> Restore(const StoredSession& stored, const ServiceOptions& options,
                                                          MemoryBudget& memory, Clock clock,
                                                          std::shared_ptr<TenantPoints> tenant_points, SessionLog& log);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // ---- Description, labels, lease and end: session.cc ----

  const std::string& tenant() const { return identity_.tenant; }
  const std::string& name() const { return identity_.name; }
  int dimension() const { return identity_.dimension; }
  absl::Time create_time() const { return identity_.create_time; }
  // The state as it is now: a value, which does not change.
  std::shared_ptr<const SessionState> state() const;
  v1::Session Describe() const;

  // Renews the lease; false when it has run out already.
  bool Renew();
  // Whether another server has taken the session over, so that this one has nothing to say of it.
  bool IsElsewhere() const;
  // From now on it is. `address`: that of the other server; empty: not known.
  void NoteElsewhere(const std::string& address = "");
  // A session with a SessionUse, or with an operation under way, does not expire.
  bool IsExpired() const;

  // Changes the given properties.
  //
  // Errors:     REVISION_MISMATCH, SESSION_NOT_FOUND. Of this and all other changes, besides those named there:
  //             DISK_FULL, STORE_FAILED.
  absl::Status Update(const std::optional<std::map<std::string, std::string>>& labels,
                      std::optional<absl::Duration> ttl, uint64_t expected_revision,
                      const AnswerTo<v1::Session>& answer = nullptr);

  // For a session that leaves its registry: from now on every change, and every question about points and mesh, ends
  // with SESSION_NOT_FOUND. Returns the operation that is under way, which the caller is to cancel, or null.
  //
  // Errors:     REVISION_MISMATCH, SESSION_NOT_FOUND (it was closed before): nothing has been done.
  absl::StatusOr<std::shared_ptr<Operation>> Close(uint64_t expected_revision,
                                                   const std::optional<store::v1::AnswerRecord>& answer = std::nullopt);
  // Closes the session if its lease has run out, so that nothing is under way. Says whether it has; also of a session
  // that another server has taken over, whose place here is free then.
  bool CloseIfExpired();

  // Writes down that a session which was closed by its lease is no more. Should that fail, it is there again after the
  // next start, with a new lease; until then it may be tried again.
  //
  // Errors:     those of SessionLog::Commit.
  absl::Status LogExpiry();

  // ---- Uploads: session_points.cc ----

  // A range of points that a client believes the session to have, with their checksum.
  struct Prefix {
    uint64_t first = 0;  // points
    uint64_t end = 0;    // points; first <= end
    uint32_t crc32c = 0;
  };
  // Refuses an upload that goes on where another has ended.
  //
  // Errors:     SESSION_BUSY, UPLOAD_GAP, UPLOAD_MISMATCH.
  absl::Status CheckPrefix(const Prefix& prefix) const;

  // Appends `coordinates`: whole points, of which the first becomes number `offset` of the session. Where the session
  // has points already, they have to be equal, and are not appended again. `expected_revision` 0: any. With a log that
  // is durable they belong to the session when CommitPoints has succeeded, and do not wait for it here.
  //
  // Errors:     INVALID_CHUNK_SHAPE, INVALID_POINTS, UPLOAD_GAP, UPLOAD_MISMATCH, SESSION_BUSY, TOO_MANY_POINTS,
  //             QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH, SESSION_NOT_FOUND. Nothing has been appended.
  absl::Status Append(uint64_t offset, std::span<const double> coordinates, uint64_t expected_revision);
  // Makes all points that were appended the session's, for good. On an error those that are not are dropped, unless
  // vertices are being added or the mesher is built again: the next change commits them.
  absl::Status CommitPoints();
  // Bytes of points that are appended and not committed.
  uint64_t UncommittedBytes() const;

  // ---- Points that are taken out: session_removal.cc ----

  // Takes the points with these `numbers` out, and numbers the others anew, in their order: all or, on an error, none.
  // The structure goes with them: the next refinement begins another one, and until then the mesh is the last one.
  // `expected_revision` 0: any.
  //
  // Complexity: O(points + numbers log numbers), on this thread.
  // Errors:     INVALID_POINTS, SESSION_BUSY, MEMORY_LIMIT, REVISION_MISMATCH, SESSION_NOT_FOUND; DATA_LOSS.
  absl::StatusOr<PointsLeft> RemovePoints(std::span<const uint64_t> numbers, uint64_t expected_revision,
                                          const AnswerTo<PointsLeft>& answer = nullptr);

  // ---- Segments or triangles, seeds and rules: session_features.cc ----

  // Appends the features and seeds of `part`, of which the first become those of the numbers `offset`, and takes over
  // its rules: all or, on an error, none. Where the session has features and seeds already, they have to be equal, and
  // are not appended again. `expected_revision` 0: any.
  //
  // Errors:     INVALID_SEGMENTS, INVALID_TRIANGLES, INVALID_CHUNK_SHAPE, UPLOAD_GAP, UPLOAD_MISMATCH, DOMAIN_FIXED,
  //             SESSION_BUSY, TOO_MANY_POINTS, QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH, SESSION_NOT_FOUND.
  absl::Status AddFeatures(const FeaturePart& part, const FeatureCounts& offset, uint64_t expected_revision);

  // ---- Sizes at points: session_sizes.cc ----

  // Replaces the sizes at points that the next refinements keep to; null for none. `expected_revision` 0: any.
  // `received`, if not null, is the memory reserved for them: it is given back as far as the session reserves it.
  //
  // REQUIRES:   `samples` has passed CheckSizes.
  // Complexity: O(samples).
  // Errors:     INVALID_SIZES (outside the domain), SESSION_BUSY, QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH,
  //             SESSION_NOT_FOUND. Nothing has changed.
  absl::Status SetSizes(const std::shared_ptr<const core::SizeSamples>& samples, uint64_t expected_revision,
                        MemoryReservation* received = nullptr);

  // ---- Meshes and queries, and memory that is given up for other work: session.cc ----

  // Its last mesh, the one before, and their products. Questions about them end with MESH_NOT_READY or
  // SESSION_NOT_FOUND where there is none.
  SessionMeshes& meshes() const { return meshes_; }
  // Runs `query` on this thread, a worker's. Any number of queries run at once. An operation that begins waits for the
  // queries that run: keep each short (some milliseconds), and call this again for the next batch.
  // `version` is the structure's: 0 for the first batch, which sets it; later batches leave it as it was set.
  //
  // Errors:     MESH_NOT_READY, SESSION_BUSY, SESSION_NOT_FOUND; REVISION_MISMATCH when the structure is no longer at
  //             `version`; those of `query`.
  absl::Status Query(uint64_t* version, const std::function<absl::Status(const core::Mesher&)>& query) const;

  // The memory that the session can give up for other work.
  struct Spare {
    uint64_t bytes = 0;                              // that GiveUpMemory frees
    absl::Duration last_use = absl::ZeroDuration();  // since boot
  };
  // Nothing of a session that is busy, or whose structure is in use, or which ends with the process, but an earlier
  // mesh.
  std::optional<Spare> GetSpare() const;
  // To be called, without a lock, where the session was busy, or its structure, its locator or a cut in use: it may be
  // spared.
  void NoteIdle() const;
  // Gives up, for other work, the mesher and all that SessionMeshes::GiveUp does. The mesher comes back as
  // PrepareStructure and operations say. Returns how much memory that has freed: 0, and nothing is done, where there is
  // nothing to spare.
  //
  // Complexity: that of freeing the mesher, on this thread, without a lock.
  uint64_t GiveUpMemory();

  // ---- The structure, and vertices that are added: session_structure.cc ----

  // Makes sure that the session has a structure for queries and additions. Where the mesher was given up, `job` builds
  // it again, on this thread, a worker's. `*is_at_work`: another job builds it now, and the status is SESSION_BUSY.
  //
  // Errors:     MESH_NOT_READY, SESSION_BUSY, SESSION_NOT_FOUND, REVISION_MISMATCH; of building it again: MEMORY_LIMIT,
  //             OUT_OF_MEMORY, CANCELLED. The caller may try again.
  absl::Status PrepareStructure(uint64_t expected_revision, const MesherFactory& create_mesher, Job& job,
                                bool* is_at_work = nullptr);

  // Adds vertices at `points` on this thread, a worker's: all or, on an error, none. `near` has a vertex for each, or
  // is empty.
  //
  // REQUIRES:   PrepareStructure has succeeded; if the mesher was given up since, the error is MESH_NOT_READY. A
  //             StructureUse keeps others from having it given up.
  // Errors:     MESH_NOT_READY, SESSION_BUSY, INVALID_CHUNK_SHAPE, INVALID_REQUEST (the length of `near`),
  //             INVALID_POINTS, VERTEX_OUT_OF_RANGE, TOO_MANY_POINTS, QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH,
  //             SESSION_NOT_FOUND; CANCELLED.
  absl::StatusOr<AddedVertices> AddVertices(std::span<const double> points, std::span<const uint32_t> near,
                                            uint64_t expected_revision, core::RunContext& context,
                                            const AnswerTo<AddedVertices>& answer = nullptr);

  // The size of the inputs that there are to work on.
  struct Size {
    uint64_t points = 0;
    uint64_t segments = 0;
    uint64_t triangles = 0;
    std::vector<double> some_points;  // all, if they are at most `few`; else none
    uint64_t vertices = 0;            // of the last mesh
    uint64_t replayed_steps = 0;  // that have to be replayed before other work than one that begins a structure anew
  };
  Size GetSize(uint64_t few) const;

  // ---- Operations: session_operations.cc ----

  // For a session that was restored: writes down the new process's change of its operation, and returns it, for
  // its work to be done; or null, if none was under way.
  absl::StatusOr<std::shared_ptr<Operation>> ResumeOperation();
  // Begins an operation. The session is busy until the operation has ended. `submit` is called with it, without any
  // lock, to submit its work; refused work is not begun. With `restart` the structure is made anew, in the same box.
  //
  // Errors:     SESSION_BUSY, REVISION_MISMATCH, SESSION_NOT_FOUND; INVALID_PARAMETERS, of those that such a
  //             domain does not have; STORAGE_QUOTA_EXCEEDED, where there is no byte left for a first mesh; those
  //             of `submit`. Of a log that fails, and of a session that is closed meanwhile, `submit` was called, and
  //             the operation has ended without a trace.
  using SubmitWork = std::function<absl::Status(const std::shared_ptr<Operation>&)>;
  absl::StatusOr<std::shared_ptr<Operation>> StartOperation(core::MeshParameters parameters, bool restart,
                                                            uint64_t expected_revision, const SubmitWork& submit,
                                                            const AnswerTo<v1::Operation>& answer = nullptr);
  // On the worker: the data to work on; nothing if the operation has ended before it could begin. Nothing, too, if it
  // is offered, and the offer could not be withdrawn: another server has taken it, or it is to be tried again.
  //
  // REQUIRES:   the operation has its job.
  std::optional<SessionWork> BeginWork(Operation& operation);
  // Takes back the work of BeginWork, and ends the operation. One whose job was cancelled while no client has asked for
  // it, and which the log keeps, is not ended: the next process goes on with it.
  //
  // False:      the log has no room for the end, or its store is away, and nothing is done but that a `result` that was
  //             OK is an error now. To be called again after a while.
  bool EndWork(Operation& operation, WorkResult& result);
  // Ends an operation that still waits for a worker as CANCELLED. Of one that runs it is noted that a client has asked
  // for its end. Returns the job that the caller is to cancel, which one that runs has; null if there is none, or the
  // operation had ended.
  absl::StatusOr<std::shared_ptr<Job>> Cancel(Operation& operation);

  // Errors:     OPERATION_NOT_FOUND.
  absl::StatusOr<std::shared_ptr<Operation>> FindOperation(const std::string& operation_name) const;
  // An operation of this session as it is told to clients.
  //
  // Errors:     SESSION_ELSEWHERE: it goes on there, whatever became of it here.
  absl::StatusOr<v1::Operation> Tell(const Operation& operation) const;
  // The operations after number `after`, the oldest first, at most `count`.
  std::vector<std::shared_ptr<Operation>> ListOperations(uint64_t after, size_t count) const;

  // ---- Operations that other servers may do: session_offers.cc ----

  // An operation that waits for a worker, in whose work no process has died.
  struct Waiting {
    std::string operation;       // its name
    absl::Time since;            // it was asked for
    bool is_offered = false;     // with its session
    bool has_structure = false;  // which another server would have to build again
    bool is_read = false;        // a call reads the last mesh
  };
  std::optional<Waiting> GetWaiting() const;
  // From now on other servers may take the session over, or may not any more. Nothing is done where that is so already,
  // or no operation waits.
  //
  // Errors:     SESSION_ELSEWHERE: one has.
  absl::Status SetOffer(bool stands);
  // Whether other servers may take the session over, or have: this one is to ask before it tells of it.
  bool IsOffered() const;
  // Another server, at `address`, has taken the session over for its operation. Those who watch it are told. Returns
  // the job that the caller is to cancel; null: there is none.
  std::shared_ptr<Job> GiveAway(const std::string& address);

  // The inputs of the work that has made the session busy.
  SessionInputs inputs() const;
  // Keeps `mesh`, the work of an operation that is under way, as the log keeps meshes.
  //
  // Errors:     those of Files::KeepMesh; STORAGE_QUOTA_EXCEEDED.
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(core::Mesh mesh, const core::RunContext& context) const;

 private:
  friend class SessionUse;
  friend class StructureUse;
  friend class UploadUse;
  friend class PointRemoval;
  friend class VertexAddition;

  // The constants of a session.
  struct Identity {
    std::string tenant;
    std::string name;  // "sessions/{session}"
    int dimension = 0;
    absl::Time create_time;
  };
  // The data that clients have sent.
  struct Stores {
    int dimension = 0;
    store::v1::PointsFile file;  // where points are appended
    std::shared_ptr<PointStore> points;
    uint32_t new_crc32c = 0;  // of the points behind those of the state, which are not committed
    std::shared_ptr<FeatureStore> features = std::make_shared<FeatureStore>();
    SizeSets sizes{};
    bool are_loaded = true;  // false: features and sizes were written down by another process, and not read yet

    // Points that are committed, and that are not.
    uint64_t point_count() const { return points->coordinate_count() / dimension; }
    AppendedPoints appended() const { return {.end = point_count(), .crc32c = new_crc32c, .file = file}; }
  };

  // The answer to the request that has asked for a change, made of the state after it. It is written down with the
  // change; none where the request has no id.
  using AnswerOf = absl::FunctionRef<std::optional<store::v1::AnswerRecord>(const SessionState& after)>;
  static std::optional<store::v1::AnswerRecord> NoAnswer(const SessionState& /*after*/) { return std::nullopt; }

  Session(SessionState state, std::vector<store::v1::StepRecord::Points> committed, const ServiceOptions& options,
          MemoryBudget& memory, Clock clock, std::shared_ptr<TenantPoints> tenant_points, SessionLog& log);

  // Makes `change`: has the log commit it, if the session is not closed, and shows the state after it. `also` is called
  // with mutex_ held, when the state is shown, to change the process's own members. `answer`, if the change has none
  // yet, makes it of the state after it, and is called without mutex_.
  //
  // Errors:     as of SessionLog::Commit, OUT_OF_MEMORY: nothing has changed. SESSION_ELSEWHERE: another server has
  //             the session, and from now on it is closed here.
  absl::Status Make(SessionChange& change, absl::FunctionRef<void()> also, AnswerOf answer = NoAnswer,
                    Survives survives = Survives::kPowerLoss) ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_);
  // The part of Make that writes it down. Nothing is of a session that is closed.
  absl::Status Commit(const SessionChange& change, Survives survives) ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_);
  // Reads features and sizes that were written down by another process, if that was not done yet. Whatever looks
  // at them calls this first, without mutex_, since it reads files.
  //
  // Errors:     SESSION_NOT_FOUND, DATA_LOSS.
  absl::Status LoadInputs() ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_) ABSL_LOCKS_EXCLUDED(mutex_);

  // Whether clients may ask for meshes.
  //
  // Errors:     MESH_NOT_READY, SESSION_NOT_FOUND.
  absl::Status CheckHasMesh() const ABSL_LOCKS_EXCLUDED(mutex_);

  // Of a session that was deleted: the points file that has only uncommitted points goes, too.
  void DropUnnamed() ABSL_LOCKS_EXCLUDED(mutex_);

  // The parts of StartOperation and EndWork that commit.
  absl::Status CommitStart(const std::shared_ptr<Operation>& operation, const AnswerTo<v1::Operation>& answer)
      ABSL_LOCKS_EXCLUDED(change_mutex_);
  absl::Status CommitSuccess(Operation& operation, WorkResult& result) ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_);

  const Identity identity_;
  MemoryBudget& memory_;
  const Clock clock_;
  SessionLog& log_;

  // Two locks, in their order. Locks that others take before, between and after: docs/design/sessions.md, "Locks".
  //
  // The first is the turn of changes: who holds it alone replaces the state, and may do so after a commit. The second
  // guards all that others see; it is never held over meshing, or over a commit.
  mutable absl::Mutex change_mutex_ ABSL_ACQUIRED_BEFORE(mutex_);
  mutable absl::Mutex mutex_;
  mutable SessionMeshes meshes_;  // has a lock of its own, after these

  // Never null; written with both locks held, by Make alone.
  std::shared_ptr<const SessionState> state_ ABSL_GUARDED_BY(mutex_);
  mutable Occupancy occupancy_ ABSL_GUARDED_BY(mutex_);  // queries come and go
  PointAccount account_ ABSL_GUARDED_BY(mutex_);         // of points and bytes, vertices that are being added included
  Stores stores_ ABSL_GUARDED_BY(mutex_);     // the work that has made the session busy reads them by inputs()
  SessionWork work_ ABSL_GUARDED_BY(mutex_);  // its mesher is away while work has the session; without mesh
  std::deque<std::shared_ptr<Operation>> operations_ ABSL_GUARDED_BY(mutex_);  // those of the state, alive
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_H_
