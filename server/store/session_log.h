// Where sessions are written down, so that they outlive the process.
#ifndef WELLSPACE_SERVER_STORE_SESSION_LOG_H_
#define WELLSPACE_SERVER_STORE_SESSION_LOG_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/mesh.h"
#include "server/store/mesh_snapshot.h"
#include "server/store/point_store.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// A set of sizes at points, which a session has, or has had for a step that is taken again by Replay.
struct StoredSizes {
  // Parts that are made when they are written down, one after the other, so that they are never held together.
  struct InTurn {
    size_t count = 0;
    uint64_t bytes = 0;  // of all, about
    std::function<store::v1::SizesRecord(size_t)> make{};
  };

  uint64_t number = 0;  // of those of its session; above 0
  std::vector<store::v1::SizesRecord> parts;
  InTurn in_turn{};  // come behind `parts`; none of a set that was read
};

// What changes with one change of a session: all of it, or nothing.
struct SessionChange {
  std::string session;                                   // its name
  std::optional<store::v1::SessionRecord> state{};       // what it is from now on; none: as before
  std::vector<store::v1::StepRecord> steps{};            // come behind those that there are
  std::vector<store::v1::OperationRecord> operations{};  // new, or in the place of those of their numbers
  std::vector<uint64_t> dropped_operations{};            // their numbers
  std::optional<StoredSizes> sizes{};                    // a new set
  std::vector<uint64_t> dropped_sizes{};                 // the numbers of sets
  std::optional<store::v1::AnswerRecord> answer{};       // to the request that has made the change
  bool is_deletion = false;                              // of the session and all that it has
};

// A request_id of a tenant.
struct AnswerKey {
  std::string tenant;
  std::string request_id;
};

// A session as it was written down. Its features and sizes are read when they are needed (SessionLog::ReadFeatures,
// ReadSizes).
struct StoredSession {
  store::v1::SessionRecord state;
  std::vector<store::v1::StepRecord> steps;            // all but those of features, in their order
  std::vector<store::v1::OperationRecord> operations;  // ascending by number
};

// All that was written down.
struct StoredSessions {
  std::vector<StoredSession> sessions;  // in the order of their creation
  std::vector<store::v1::AnswerRecord> answers;
};

// Files that nothing written down names.
struct Garbage {
  struct SetAside {
    std::string from;
    std::string to;
  };
  std::vector<SetAside> set_aside;   // paths; kept for a day, should they be missed
  std::vector<std::string> removed;  // paths; set aside a day ago or longer
  std::vector<std::string> unknown;  // paths; not ours, and left where they are
};

// Writes sessions down, with their points and meshes. What a log does not keep (EphemeralLog) ends with the process.
//
// Thread safety: thread-safe. Changes of one session are committed one after the other by its caller; those of several
//                sessions at once, which cost one synchronisation of the disk together.
class SessionLog {
 public:
  // What a change is to survive when Commit returns.
  enum class Survives { kPowerLoss, kProcessDeath };

  virtual ~SessionLog() = default;

  // Whether anything outlives the process.
  virtual bool is_durable() const = 0;

  // What was there at the start. To be called once, before any other function.
  //
  // Errors:     DATA_LOSS, naming the file; INTERNAL.
  virtual absl::StatusOr<StoredSessions> Load() = 0;

  // Commits `change`. The files that it names have been synchronised before.
  //
  // Errors:     DISK_FULL; UNAVAILABLE: the log can write nothing any more. Nothing has changed.
  virtual absl::Status Commit(const SessionChange& change, Survives survives = Survives::kPowerLoss) = 0;

  // Drops answers that need not be kept any longer, with one of the next commits.
  virtual void Forget(std::span<const AnswerKey> answers) = 0;

  // The segments and seeds of a session, step by step.
  //
  // Errors:     DATA_LOSS.
  virtual absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session) = 0;

  // The sets of sizes of a session, ascending by number.
  //
  // Errors:     DATA_LOSS.
  virtual absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session) = 0;

  // The points of a session of `dimension`, of which `committed` are there. `number` is that of their file
  // (SessionRecord.points_file). What is appended to a new file before a change names it ends with the process.
  virtual std::unique_ptr<PointStore> OpenPoints(const std::string& session, int dimension, uint64_t number,
                                                 std::vector<store::v1::StepRecord::Points> committed) = 0;

  // Removes the points file that `session` has no more, or that it has not come to have.
  virtual void DropPoints(const std::string& session, uint64_t number) = 0;

  // Keeps `mesh` as that of `revision`: when it returns, what it has written outlives a loss of power. Until a change
  // names it (SessionRecord.mesh) it ends with the process all the same.
  //
  // Errors:     DISK_FULL, UNAVAILABLE; CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& session, uint64_t revision,
                                                                 core::Mesh mesh, const core::RunContext& context) = 0;

  // Sets files aside that nothing written down names, and removes those that were a day ago. To be called after the
  // start, and hourly; the first call removes nothing.
  virtual absl::StatusOr<Garbage> RemoveGarbage() = 0;

  // The mesh that `record` names. Its file is looked at when something of it is asked for.
  virtual std::shared_ptr<MeshSnapshot> FindMesh(const std::string& session,
                                                 const store::v1::SessionRecord& record) = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SESSION_LOG_H_
