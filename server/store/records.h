// The records of sessions: all that is stored of them but their points and meshes. One change is made at a time.
#ifndef WELLSPACE_SERVER_STORE_RECORDS_H_
#define WELLSPACE_SERVER_STORE_RECORDS_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
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

// An offer of a session to other processes that share the records, for its operation that waits for a worker.
struct WorkOffer {
  bool stands = false;   // else it is withdrawn
  std::string tenant{};  // of the session
};

// The parts of one change of a session: all of them are made, or none. A change without a session has usage alone.
//
// Epochs: a process that takes a session over from its owner gets its epoch, a number that none had before. A change
//         has the epoch of its owner, and is made only while the session is still at it. So an owner that was stopped,
//         and goes on when another has the session, can change nothing. Files have the epoch in their names, so that no
//         two owners write one.
struct SessionChange {
  std::string session;                                   // its name
  uint64_t epoch = 0;                                    // of the owner that changes it
  bool is_creation = false;                              // the session is new
  std::optional<store::v1::SessionRecord> state{};       // the new record; none: as before
  std::vector<store::v1::StepRecord> steps{};            // come behind those that there are
  std::vector<store::v1::OperationRecord> operations{};  // new, or in the place of those of their numbers
  std::vector<uint64_t> dropped_operations{};            // their numbers
  std::optional<StoredSizes> sizes{};                    // a new set
  std::vector<uint64_t> dropped_sizes{};                 // the numbers of sets
  std::optional<WorkOffer> offer{};                      // none: as before; but operations that change end an offer
  std::vector<store::v1::UsageRecord> usage{};           // comes on top of that of these tenants and days
  std::optional<store::v1::AnswerRecord> answer{};       // to the request that has made the change
  bool is_deletion = false;                              // of the session and all that it has
};

// A request_id of a tenant.
struct AnswerKey {
  std::string tenant;
  std::string request_id;
};

// A session as it was written down. Its features and sizes are read when they are needed (Records::ReadFeatures,
// ReadSizes).
struct StoredSession {
  uint64_t epoch = 0;  // at which the session is
  store::v1::SessionRecord state;
  std::vector<store::v1::StepRecord> steps;            // all but those of features, in their order
  std::vector<store::v1::OperationRecord> operations;  // ascending by number
};

// All sessions and answers that are stored.
struct StoredSessions {
  std::vector<StoredSession> sessions;  // in the order of their creation
  std::vector<store::v1::AnswerRecord> answers;
};

// The records of all sessions, of all owners; and the owners whose files may still come to be named.
struct Census {
  std::vector<store::v1::SessionRecord> sessions;
  uint64_t oldest_epoch = 0;  // of the owners that there are: those at epochs before it are no more
};

// What a process can do of the work that others offer.
struct RoomForWork {
  int sessions = 0;                         // that have one operation each
  std::vector<std::string> full_tenants{};  // whose work has no place here
};

// The place of an operation among all that are stored: the row of its session, and its number. The first is after {}.
struct OperationPlace {
  int64_t session = 0;
  uint64_t number = 0;
};

// An operation, and who has it.
struct StoredOperation {
  OperationPlace place;
  std::string session;  // its name
  std::string tenant;   // of the session
  std::string owner;    // the name of the process
  std::string address;  // where it serves; empty: it has not told
  store::v1::OperationRecord operation;
};

// The usage that is asked for.
struct UsageRange {
  std::string tenant{};  // empty: all
  int64_t first_day = std::numeric_limits<int32_t>::min();
  int64_t last_day = std::numeric_limits<int32_t>::max();
};

// The usage of a tenant: its work of the days asked for, and the data that its sessions keep now.
struct TenantUsage {
  uint64_t meshes = 0;
  uint64_t vertices = 0;
  int64_t processor_time_ns = 0;
  uint64_t sessions = 0;
  uint64_t stored_bytes = 0;
};
using UsageByTenant = std::map<std::string, TenantUsage>;

// Adds the work of `record`.
void AddWork(const store::v1::UsageRecord& record, UsageByTenant& usage);
void AddWork(const store::v1::UsageRecord& more, store::v1::UsageRecord& sum);
// Adds what the session of `record` keeps.
void AddSession(const store::v1::SessionRecord& record, UsageByTenant& usage);
// The day of `time` in UsageRecord.
int32_t DayOf(absl::Time time);

// The owner of a session, where several processes share the records.
struct SessionOwner {
  std::string tenant;    // of the session
  std::string address;   // where the owner serves; empty: it has not told
  bool is_self = false;  // this process
  bool lives = false;    // else the session is Take's, or TakeOrphans'
};

// Where the points of a session are: SessionRecord.points_files, also of a record that is older than these.
std::vector<store::v1::PointsFile> PointsFilesOf(const store::v1::SessionRecord& record);

// The error of Records::Apply if the request that the change answers was answered before; whether a status is it.
absl::Status AnsweredBefore(const std::string& request_id);
inline bool IsAnsweredBefore(const absl::Status& status) { return absl::IsAlreadyExists(status); }

// The error of Records::Apply if the change is not the session's owner's; whether a status is it.
absl::Status OwnedElsewhere(const std::string& session);
inline bool IsOwnedElsewhere(const absl::Status& status) { return absl::IsAborted(status); }

// The worst event that a change is to outlive once it is made.
enum class Survives { kPowerLoss, kProcessDeath };

// The records of sessions. Records that are not durable (MemoryRecords) end with the process.
//
// Thread safety: thread-safe. Changes of one session are applied one after the other by its caller; those of several
//                sessions at once, which cost one synchronisation of the disk together.
// Errors:        of functions that read: DATA_LOSS, naming the file; STORE_FAILED; INTERNAL.
class Records {
 public:
  virtual ~Records() = default;

  // Whether anything outlives the process.
  virtual bool is_durable() const = 0;

  // The epoch of the sessions that this process creates, and of those that it has taken over when it began.
  virtual uint64_t epoch() const = 0;

  // The stored sessions that this process owns, and the answers, at the start. To be called once, before all others.
  virtual absl::StatusOr<StoredSessions> Load() = 0;

  // Takes a session over from its owner; none: there is no such session. Changes that the former owner has not made by
  // now fail.
  //
  // Errors:     DISK_FULL.
  virtual absl::StatusOr<std::optional<StoredSession>> Take(const std::string& session) = 0;

  // Applies `change`. The files that it names have been synchronised before.
  //
  // Errors:     ABORTED: the session is at another epoch, or another owner has deleted it. ALREADY_EXISTS: the request
  //             that it answers was answered before, by any process. DISK_FULL; STORE_FAILED: nothing can be written
  //             any more. Nothing has changed.
  virtual absl::Status Apply(const SessionChange& change, Survives survives) = 0;

  // The answer to a request; none: it was not answered, or the answer was dropped.
  virtual absl::StatusOr<std::optional<store::v1::AnswerRecord>> FindAnswer(const AnswerKey& request) = 0;

  // Drops answers that need not be kept any longer, with one of the next changes.
  virtual void Forget(std::span<const AnswerKey> answers) = 0;

  // The segments and seeds of a session, step by step.
  virtual absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session) = 0;

  // The sets of sizes of a session, ascending by number.
  virtual absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session) = 0;

  // What SessionChange.usage has told, by all processes, and what sessions keep, as of one moment. Of a tenant that has
  // neither there is nothing.
  //
  // Complexity: O(sessions + days of tenants): looks at all of them.
  virtual absl::StatusOr<UsageByTenant> ReadUsage(const UsageRange& range) = 0;

  // The record of a session; none: there is no such session, or none is kept.
  virtual absl::StatusOr<std::optional<store::v1::SessionRecord>> ReadRecord(const std::string& session) = 0;

  // Those of all sessions, of all owners, in the order of their creation.
  //
  // Errors:     ABORTED: this process owns nothing any more.
  virtual absl::StatusOr<Census> ReadCensus() = 0;

  // ---- Where several processes own sessions at once. What stands here is of records that one process has at a time.

  virtual bool is_shared() const { return false; }

  // Tells the others where this process serves.
  virtual absl::Status Announce(const std::string& /*address*/) { return absl::OkStatus(); }

  // Whether what this process knows of its sessions is still so: no other may have taken them.
  //
  // Complexity: O(1), without the database.
  // Errors:     STORE_FAILED: it is not known now.
  virtual absl::Status CheckOwnership() const { return absl::OkStatus(); }

  // None: there is no such session.
  virtual absl::StatusOr<std::optional<SessionOwner>> FindOwner(const std::string& /*session*/) {
    return std::optional<SessionOwner>();
  }

  // Takes over all sessions of owners that are no more, at an epoch that is new. To be called again and again.
  virtual absl::StatusOr<std::vector<StoredSession>> TakeOrphans() { return std::vector<StoredSession>(); }

  // Takes over sessions that their owners offer, those first that were offered first, each at an epoch that is new. No
  // session is taken by two processes, or once its operation has begun. To be called again and again.
  virtual absl::StatusOr<std::vector<StoredSession>> TakeOffered(const RoomForWork& /*room*/) {
    return std::vector<StoredSession>();
  }

  // The first `count` operations behind `after`, of all owners, those of a session together.
  virtual absl::StatusOr<std::vector<StoredOperation>> ListOperations(const OperationPlace& /*after*/,
                                                                      size_t /*count*/) {
    return std::vector<StoredOperation>();
  }

  // The names of the sessions that this process offers, and still owns.
  virtual absl::StatusOr<std::vector<std::string>> ListOffered() { return std::vector<std::string>(); }
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_RECORDS_H_
