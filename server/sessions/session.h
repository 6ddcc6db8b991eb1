// A session: a domain, its points, segments and sizes, and the mesh over them.
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
#include "server/sessions/answer_to.h"
#include "server/sessions/feature_store.h"
#include "server/sessions/lease.h"
#include "server/sessions/mesh_deltas.h"
#include "server/sessions/operation.h"
#include "server/sessions/point_account.h"
#include "server/sessions/session_box.h"
#include "server/sessions/session_locator.h"
#include "server/sessions/session_steps.h"
#include "server/sessions/session_work.h"
#include "server/store/mesh_snapshot.h"
#include "server/store/point_store.h"
#include "server/store/session_log.h"
#include "wellspace/store/v1/records.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// What AddVertices did.
struct AddedVertices {
  std::vector<uint32_t> vertices;  // by point
  uint64_t revision = 0;           // of the session
};

// What a session has after points were removed.
struct PointsLeft {
  uint64_t points = 0;
  uint64_t revision = 0;  // of the session
};

// A session. Its functions are in several files, which the parts of the class name:
//
//   session.cc             what clients see, labels, lease and end; queries; the mesher that is given up; checks
//   session_points.cc      uploads                           session_features.cc    segments, seeds, rules of faces
//   session_removal.cc     points that are taken out         session_operations.cc  operations
//   session_sizes.cc       sizes at points
//   session_structure.cc   the mesher that is built again, vertices that are added, the locator
//   session_record.cc      how it is written down, and comes back
//
// What it is made of: session_work.h (mesher and mesh), session_steps.h, session_locator.h, mesh_deltas.h,
// point_account.h, lease.h, operation.h, feature_store.h, session_box.h. Its states, and what changes them:
// docs/design/sessions.md, "States".
//
// Thread safety: thread-safe. Which lock is for what, and their order: below, at the members. Functions that change the
//                session wait for the log: they are to be called where that holds up no other work.
// Invariants: (1) revision grows with every change of the points, the features, the sizes or the mesh; (2) while the
// session is busy, points, features, sizes, mesh, mesher and steps are touched by the work alone that has made it so;
// (3) what did not succeed leaves the session as it was: structure and mesh are what Replay makes of the steps, whether
// there is a mesher now or not; (4) no client is told of a change, and nothing shows it, before the log has it; one
// that it cannot have is not made. An expiry, and what becomes of an operation, show even where it cannot have them.
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

  // REQUIRES:   `options`, `memory` and `log` outlive this.
  Session(Settings settings, const ServiceOptions& options, MemoryBudget& memory, Clock clock,
          std::shared_ptr<TenantPoints> tenant_points, SessionLog& log);
  // The session that was written down as `stored`: without mesher, its files not looked at yet. Its lease begins anew.
  // An operation that had not ended waits for a worker again.
  //
  // Errors:     those of parameters that this server does not know any more.
  static absl::StatusOr<std::shared_ptr<Session>> Restore(const StoredSession& stored, const ServiceOptions& options,
                                                          MemoryBudget& memory, Clock clock,
                                                          std::shared_ptr<TenantPoints> tenant_points, SessionLog& log);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // ---- What clients see, labels, lease and end: session.cc ----

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
  // Errors:     REVISION_MISMATCH, SESSION_NOT_FOUND. Of this and all other changes, besides what is named there:
  //             DISK_FULL, STORE_FAILED.
  absl::Status Update(std::optional<std::map<std::string, std::string>> labels, std::optional<absl::Duration> ttl,
                      uint64_t expected_revision, const AnswerTo<v1::Session>& answer = nullptr);

  // For a session that leaves its registry: from now on every change, and every question about points and mesh, ends
  // with SESSION_NOT_FOUND. Returns the operation that is under way, which the caller is to cancel, or null.
  //
  // Errors:     REVISION_MISMATCH, SESSION_NOT_FOUND (it was closed before): nothing has been done.
  absl::StatusOr<std::shared_ptr<Operation>> Close(uint64_t expected_revision,
                                                   const std::optional<store::v1::AnswerRecord>& answer = std::nullopt);
  // Closes the session if its lease has run out, so that nothing is under way. Says whether it has.
  bool CloseIfExpired();

  // ---- How it is written down, and comes back: session_record.cc; Restore, above, too ----

  // Writes down that there is this session. To be called once, of a new one, before others know it.
  absl::Status LogCreation(const AnswerTo<v1::Session>& answer);
  // For one that was written down before: writes down what the new process has changed of its operation, and returns
  // it, for its work to be done; or null, if none was under way.
  absl::StatusOr<std::shared_ptr<Operation>> ResumeOperation();
  // Writes down that a session which was closed by its lease is no more. Should that fail, it is there again after the
  // next start, with a new lease; until then it may be tried again.
  //
  // Errors:     those of SessionLog::Commit.
  absl::Status LogExpiry();

  // ---- Uploads: session_points.cc ----

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
  // Points and revision, as one.
  v1::UploadPointsResponse Committed() const;

  // ---- Points that are taken out: session_removal.cc ----

  // Takes the points with these `numbers` out, and numbers the others anew, in their order: all or, on an error, none.
  // The structure goes with them: the next refinement begins another one, and until then the mesh is the last one.
  // `expected_revision` 0: any.
  //
  // Complexity: O(points + numbers log numbers), on this thread.
  // Errors:     INVALID_POINTS, SESSION_BUSY, MEMORY_LIMIT, REVISION_MISMATCH, SESSION_NOT_FOUND; DATA_LOSS.
  absl::StatusOr<PointsLeft> RemovePoints(std::span<const uint64_t> numbers, uint64_t expected_revision,
                                          const AnswerTo<PointsLeft>& answer = nullptr);

  // ---- Segments, seeds and rules of faces: session_features.cc ----

  // Appends the segments and seeds of `request`, of which the first become those of the numbers that it says, and takes
  // over its rules: all or, on an error, none. Where the session has segments and seeds already, they have to be equal,
  // and are not appended again. `expected_revision` 0: any.
  //
  // Errors:     INVALID_SEGMENTS, INVALID_CHUNK_SHAPE, UPLOAD_GAP, UPLOAD_MISMATCH, DOMAIN_FIXED, SESSION_BUSY,
  //             TOO_MANY_POINTS, QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH, SESSION_NOT_FOUND.
  absl::Status AddSegments(const v1::AddSegmentsRequest& request, uint64_t expected_revision);
  // Segments, seeds and revision, as one.
  v1::AddSegmentsResponse CommittedSegments() const;

  // ---- Sizes at points: session_sizes.cc ----

  // Replaces the sizes at points that the next refinements keep to; null for none. `expected_revision` 0: any.
  // `received`, if not null, is what was reserved for them so far: it is given back as far as the session reserves it.
  //
  // REQUIRES:   `samples` has passed CheckSizes.
  // Complexity: O(samples).
  // Errors:     INVALID_SIZES (outside the domain), SESSION_BUSY, QUOTA_EXCEEDED, MEMORY_LIMIT, REVISION_MISMATCH,
  //             SESSION_NOT_FOUND. Nothing has changed.
  // Where memory is short, idle sessions give some up first.
  absl::Status SetSizes(const std::shared_ptr<const core::SizeSamples>& samples, uint64_t expected_revision,
                        MemoryReservation* received = nullptr);
  // The number of sizes, and the revision, as one.
  v1::SetSizesResponse CommittedSizes() const;

  // ---- Mesh and queries, and what is given up for other work: session.cc ----

  // The last mesh; null before the first.
  std::shared_ptr<const MeshSnapshot> mesh() const;
  // What is known of how it came from the meshes before.
  MeshDeltas& deltas() { return deltas_; }
  const MeshDeltas& deltas() const { return deltas_; }
  // Runs `query` on this thread, a worker's. Any number of queries run at once. An operation that begins waits for the
  // queries that run: keep each short (some milliseconds), and call this again for the next batch.
  // `version` is the structure's: 0 for the first batch, which sets it; later batches leave it as it was set.
  //
  // Errors:     MESH_NOT_READY, SESSION_BUSY, SESSION_NOT_FOUND; REVISION_MISMATCH when the structure is no longer at
  //             `version`; those of `query`.
  absl::Status Query(uint64_t* version, const std::function<absl::Status(const core::Mesher&)>& query) const;

  // What of the session's memory other work may have.
  struct Spare {
    uint64_t bytes = 0;                              // that GiveUpMesher frees
    absl::Duration last_use = absl::ZeroDuration();  // since boot
  };
  // Nothing of a session that is busy, or whose structure is in use, or which ends with the process.
  std::optional<Spare> GetSpare() const;
  // To be called, without a lock, where the session was busy, or its structure or its locator in use: it may be spared.
  void NoteIdle() const;
  // Gives the mesher up for other work, what points are located by, and the differences of meshes. The first two come
  // back as PrepareStructure, PrepareLocator and operations say. Returns how much memory that has freed: 0, and nothing
  // is done, where there is nothing to spare.
  //
  // Complexity: that of freeing the mesher, on this thread, without a lock.
  uint64_t GiveUpMesher();
  // How long memory is reserved for its mesher.
  Lasts MesherLasts() const { return log_.is_durable() ? Lasts::kUntilWanted : Lasts::kSession; }

  // ---- The structure, vertices that are added, and the locator: session_structure.cc ----

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

  // The session's last mesh, for points to be located in, as SessionLocator::Prepare says. `revision` 0: any.
  //
  // Errors:     MESH_NOT_READY, REVISION_MISMATCH, SESSION_NOT_FOUND; of making it: MEMORY_LIMIT, CANCELLED, DATA_LOSS.
  absl::StatusOr<std::shared_ptr<const LocatedMesh>> PrepareLocator(uint64_t revision, Job& job);
  // Whether that is there, and need not be made.
  bool HasLocator() const;

  // How much there is to work on now.
  struct Size {
    uint64_t points = 0;
    uint64_t segments = 0;
    std::vector<double> some_points;  // all, if they are at most `few`; else none
    uint64_t vertices = 0;            // of the last mesh
    uint64_t replayed_steps = 0;  // that have to be replayed before other work than one that begins a structure anew
  };
  Size GetSize(uint64_t few) const;

  // ---- Operations: session_operations.cc ----

  // Begins an operation. The session is busy until the operation has ended. `submit` is called with it, to submit its
  // work; what it refuses is not begun. With `restart` the structure is made anew, in the same box.
  //
  // Errors:     SESSION_BUSY, REVISION_MISMATCH, SESSION_NOT_FOUND; INVALID_PARAMETERS, of those that a domain with
  //             segments does not have; STORAGE_QUOTA_EXCEEDED, where there is no byte left for a first mesh; those
  //             of `submit`. Of a log that fails, `submit` was called, and the operation
  //             has ended without a trace.
  using SubmitWork = std::function<absl::Status(const std::shared_ptr<Operation>&)>;
  absl::StatusOr<std::shared_ptr<Operation>> StartOperation(core::MeshParameters parameters, bool restart,
                                                            uint64_t expected_revision, const SubmitWork& submit,
                                                            const AnswerTo<v1::Operation>& answer = nullptr);
  // On the worker: what to work on; nothing if the operation has ended before it could begin.
  //
  // REQUIRES:   the operation has its job.
  std::optional<SessionWork> BeginWork(Operation& operation);
  // Takes back what BeginWork gave, and ends the operation. One whose job was cancelled while no client has asked for
  // it, and which the log keeps, is not ended: the next process goes on with it.
  //
  // False:      the log has no room for the end, and nothing is done but that a `result` that was OK is an error now.
  //             To be called again after a while.
  bool EndWork(Operation& operation, WorkResult& result);
  // Ends an operation that still waits for a worker as CANCELLED. Of one that runs it is noted that a client has asked
  // for its end. Returns the job that the caller is to cancel, which one that runs has; null if there is none, or the
  // operation had ended.
  absl::StatusOr<std::shared_ptr<Job>> Cancel(Operation& operation);

  // Errors:     OPERATION_NOT_FOUND.
  absl::StatusOr<std::shared_ptr<Operation>> FindOperation(const std::string& operation_name) const;
  // The operations after number `after`, the oldest first, at most `count`.
  std::vector<std::shared_ptr<Operation>> ListOperations(uint64_t after, size_t count) const;

  // The following are for the operation that is under way.
  const PointStore& points() const { return *points_; }
  const FeatureStore& features() const { return features_; }
  // Those of `operation`, and the sizes at points that it keeps to.
  core::MeshParameters ParametersOf(const Operation& operation) const;
  // What has made the structure.
  const SessionSteps& steps() const { return steps_; }
  // The revision of the mesh that it makes.
  uint64_t NextMeshRevision() const;
  // Keeps `mesh`, the work of an operation that is under way, as the log keeps meshes.
  //
  // Errors:     those of SessionLog::KeepMesh; STORAGE_QUOTA_EXCEEDED.
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(core::Mesh mesh, const core::RunContext& context) const;

 private:
  friend class SessionUse;
  friend class StructureUse;

  // Which change of the points or the mesh is under way. There is one at most.
  enum class Busy { kNo, kStarting, kOperation, kAddingVertices, kRemovingPoints, kReplaying };

  // ---- For those that hold change_mutex_, and not mutex_ ----

  // Writes down what `fill` makes of an empty change, if the log keeps anything and the session is not closed.
  absl::Status Commit(const std::function<void(SessionChange&)>& fill,
                      SessionLog::Survives survives = SessionLog::Survives::kPowerLoss);
  // The same of a change that has the state of the session as it is now.
  absl::Status CommitState(const std::function<void(SessionChange&)>& fill);
  // Reads segments, seeds and sizes that were written down by another process, if that was not done yet. Whatever looks
  // at them calls this first, without mutex_, since it reads files.
  //
  // Errors:     SESSION_NOT_FOUND, DATA_LOSS.
  absl::Status LoadInputs();
  absl::Status LoadSizes();
  // Writes down what AddSegments has appended: all of `request` but for what was known.
  absl::Status CommitFeatures(const v1::AddSegmentsRequest& request, uint64_t known_segments, uint64_t known_seeds);
  // Adds to `change` that points have come: those from committed_points_ on, up to number `end`, whose checksum is
  // `crc32c`.
  void AddPointsTo(SessionChange& change, uint64_t end, uint32_t crc32c) const;
  absl::Status CommitStart(const Operation& operation, uint64_t end, const AnswerTo<v1::Operation>& answer);
  absl::Status CommitSuccess(const Operation& operation, const WorkResult& result, absl::Time now);
  // Counts the mesh of the work against the tenant's bytes, and commits it: both or, on an error, neither.
  absl::Status TakeSuccess(const Operation& operation, const WorkResult& result, absl::Time now);

  // ---- For those that hold mutex_; const ones also for the work that has made the session busy, without it ----

  v1::Session DescribeWithLocked(const std::map<std::string, std::string>& labels, absl::Duration ttl) const;
  store::v1::SessionRecord RecordLocked() const;
  void KeepLocked(std::shared_ptr<Operation> operation);
  // The points up to number `end` are the session's from now on.
  void NotePointsLocked(uint64_t end);
  // All points are meshed, by `operation`, which has succeeded.
  void NoteRefinementLocked(const Operation& operation);
  // The sets of sizes that are of no use once only `steps`, and the set `current`, are there.
  std::vector<SizesInUse> UnusedSizesLocked(const SessionSteps& steps, uint64_t current) const;
  // Drops points that are not committed.
  void DropUncommittedLocked();
  // What GiveUpMesher would free, of a durable session.
  uint64_t SpareBytesLocked() const;
  uint64_t PointCountLocked() const { return points_->coordinate_count() / dimension_; }
  // Of the points that are appended and not committed.
  bool HasUncommittedLocked() const { return PointCountLocked() > committed_points_; }
  // What the revision is when what was appended is committed.
  uint64_t NextRevisionLocked() const { return revision_ + (HasUncommittedLocked() ? 1 : 0); }
  // Refuses ascending `numbers` that are not all points, or of which segments are made.
  absl::Status CheckRemovableLocked(std::span<const uint64_t> numbers) const;
  absl::Status CheckOpenLocked() const;
  absl::Status CheckRevisionLocked(uint64_t expected_revision) const;
  absl::Status CheckIdleLocked() const;
  // All three of these.
  absl::Status CheckReadyForChangeLocked(uint64_t expected_revision) const;
  // Whether there is a mesh.
  absl::Status CheckMeshLocked() const;
  // Whether there is a structure to query, or steps that Replay can take.
  absl::Status CheckStepsLocked() const;
  // Whether there is a structure to query now.
  absl::Status CheckStructureLocked() const;
  SessionBox BoxLocked() const;
  void CloseNowLocked();
  // The session is the caller's alone until EndBusyLocked, and does not expire.
  void BeginBusyLocked(Busy busy);
  void EndBusyLocked();

  // ---- For those that hold neither ----

  // What Restore sets besides steps and operations, before others know the session.
  void SetState(const StoredSession& stored);
  // What SetSizes and AddSegments do, but for RetryWithRoom.
  absl::Status TryToSetSizes(const std::shared_ptr<const core::SizeSamples>& samples, uint64_t expected_revision,
                             MemoryReservation* received);
  absl::Status TryToAddSegments(const v1::AddSegmentsRequest& request, uint64_t expected_revision);
  // Returns `change()`. Where memory has no room for it, it is called once more after idle sessions gave up `bytes`.
  absl::Status RetryWithRoom(uint64_t bytes, const std::function<absl::Status()>& change);
  // The last mesh. Errors: SESSION_NOT_FOUND, MESH_NOT_READY, REVISION_MISMATCH. `revision` 0: any.
  absl::StatusOr<std::shared_ptr<const MeshSnapshot>> MeshAt(uint64_t revision) const;
  // Waits for the queries that run. To be called when the session is busy, so that no other can begin.
  void WaitForQueries();
  // Builds the mesher again. For the work that has made the session Busy::kReplaying.
  absl::Status Rebuild(const MesherFactory& create_mesher, Job& job);

  // The parts of AddVertices, in their order.

  // What it does before it touches the mesher; makes the session Busy::kAddingVertices. The following are for the work
  // that has made it so.
  absl::Status BeginAddition(std::span<const double> points, std::span<const uint32_t> near,
                             uint64_t expected_revision);
  // The part that the mesher does. First it takes in the points that were uploaded since it was last refined;
  // `*uploaded` says how many it has taken in, on an error too.
  absl::StatusOr<std::vector<uint32_t>> AddToMesher(std::span<const double> points, std::span<const uint32_t> near,
                                                    core::RunContext& context, uint64_t* uploaded);
  // The end where the mesher has taken `points` in, after `uploaded` others: the log has them then.
  absl::Status CommitAddition(std::span<const double> points, uint64_t uploaded, const AnswerTo<AddedVertices>& answer,
                              AddedVertices* added);
  // Gives the mesher up, where it has what the session does not get.
  void DropMesher();

  // The parts of RemovePoints, in their order.

  // What it does before it copies points; makes the session Busy::kRemovingPoints. The following are for the work that
  // has made it so.
  absl::Status BeginRemoval(std::span<const uint64_t> numbers, uint64_t expected_revision);
  // What is left of the points.
  struct KeptPoints {
    MemoryReservation memory;           // that the copy takes besides, if it is in memory
    std::unique_ptr<PointStore> store;  // synchronised
    uint64_t file = 0;                  // its number
    uint32_t crc32c = 0;
  };
  // `*kept` is what there is of it, on an error too.
  absl::Status CopyPointsWithout(std::span<const uint64_t> numbers, KeptPoints* kept);
  // The end: the session has what is kept from now on.
  absl::StatusOr<PointsLeft> CommitRemoval(KeptPoints& kept, const AnswerTo<PointsLeft>& answer);

  const std::string tenant_;
  const std::string name_;
  const int dimension_;
  const absl::Time create_time_;
  MemoryBudget& memory_;
  const Clock clock_;
  SessionLog& log_;

  // Locks, in their order; none is taken under one that stands below it. What others take before, between and after:
  // docs/design/sessions.md, "Locks".
  mutable std::mutex change_mutex_;          // held over a change, from its checks until it is made
  mutable std::mutex mutex_;                 // guards what is below; never held over meshing, or over a commit
  mutable std::shared_mutex queries_mutex_;  // held shared by a batch of queries, over its work
  // Beside change_mutex_: no one holds both. It has its own locks, one of them before mutex_.
  SessionLocator locator_;

  // What is below is written with mutex_ held, and read with it. But:
  //   - of a session that is busy, work_.mesher and work_.memory belong to the work that has made it so, which writes
  //     them without mutex_. Others look at busy_ first, and leave them alone;
  //   - that work reads without mutex_ what invariant (2) keeps from all others: points_, features_, sizes_, work_,
  //     steps_, parameters_; and while points are removed, when none are committed, committed_points_ and revision_;
  //   - who holds change_mutex_ reads without mutex_ what changes under both alone: parameters_, labels_, the length of
  //     lease_, features_, sizes_, sizes_in_use_, are_inputs_loaded_, steps_, operations_, next_operation_, and, of a
  //     session that is busy or durable, revision_ and committed_points_; before others know the session, busy_;
  //   - while vertices are added, none but the work that adds them takes points into point_account_, or out of it.
  core::MeshParameters parameters_;  // of the last refinement that succeeded; before it, those of the creation
  std::map<std::string, std::string> labels_;
  Lease lease_;
  bool is_closed_ = false;
  Busy busy_ = Busy::kNo;
  bool is_uploading_ = false;
  bool is_ready_ = false;  // the mesh is that of all points
  uint64_t revision_ = 1;
  // Five counts of points, each at most the one before but for the moment in which vertices are added:
  // point_account_.points() are paid for, those that AddVertices is adding included; PointCountLocked() are in points_;
  // committed_points_ are the session's, as clients see them; work_.meshed_points are in the mesher, or would be if it
  // was not given up; steps_.points() are what Replay makes a mesher of.
  PointAccount point_account_;
  uint64_t points_file_ = 0;  // the number of the file of points_, which is made with it
  std::unique_ptr<PointStore> points_;
  uint64_t committed_points_ = 0;
  uint32_t uncommitted_crc32c_ = 0;  // of the points behind the committed ones
  FeatureStore features_;
  FeatureSummary feature_summary_;                  // of them, read or not
  std::shared_ptr<const core::SizeSamples> sizes_;  // null: none, or not read
  SizesInUse sizes_in_use_;                         // which these are
  uint64_t sizes_revision_ = 0;  // at which they came, or went; 0: unknown, as none are there and another process began
  bool are_inputs_loaded_ = true;  // false: features and sizes were written down by another process, and not read yet
  SessionWork work_;               // its mesher is away while an operation runs
  SessionSteps steps_;
  uint64_t structure_version_ = 0;  // of what queries see; 0: nothing yet
  MeshDeltas deltas_;               // has a lock of its own, after mutex_
  int structure_uses_ = 0;          // while there are any, the mesher is not given up for other work
  uint64_t next_operation_ = 1;
  std::deque<std::shared_ptr<Operation>> operations_;  // ascending by number
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_H_
