// The state of a session, as its log has it; and the one function by which it changes.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_STATE_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_STATE_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/input/mesh_parameters.h"
#include "server/sessions/session_box.h"
#include "server/sessions/session_steps.h"
#include "server/store/records.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// The state of a session: all that is the same in every process that has its log. It is a value, which a Session shows
// by a pointer and never changes: the next state is another value, which Apply makes.
//
// Other data of a process (the structure, points that are not committed, who is at work, when the lease ends) are in
// Session.
//
// Thread safety: thread-compatible.
// Invariants: (1) it is Apply of all changes that the log has of the session, one after the other, to an empty state;
//             (2) `parameters` are those of `record`; (3) steps.points() <= record.points().
struct SessionState {
  // The data for clients: labels, length of the lease, revision, counts, features, set of sizes, last mesh. The
  // mesh of a log that keeps nothing has its figures here, too.
  store::v1::SessionRecord record;
  std::shared_ptr<const core::MeshParameters> parameters{};  // without sizes at points; null of an empty state
  SessionSteps steps{};                                      // none, where Replay could not take them
  std::vector<std::shared_ptr<const store::v1::OperationRecord>> operations{};  // ascending by number

  // At which the set of sizes came, or went; 0: unknown, as there is none, and another process has dropped it.
  uint64_t sizes_revision = 0;
  uint64_t structure_version = 0;  // another one for each structure that queries may see; 0: none yet
  bool is_deleted = false;
  uint64_t epoch = 0;  // at which this process owns the session; its changes carry it

  const std::string& name() const { return record.name(); }
  SizesInUse sizes() const { return {.number = record.sizes(), .count = record.size_count()}; }
};

// The state after `change`. It is the effect of a change: once it is committed, when it is read again after a restart,
// and in the tests' model of the log.
//
// REQUIRES:   it is a change of this session; the first one has the whole record.
// Guarantees: a pure function.
// Complexity: O(size of the record and of the change); steps that were there are shared.
// Errors:     those of parameters that this server does not know: INVALID_PARAMETERS.
absl::StatusOr<SessionState> Apply(const SessionState& state, const SessionChange& change);

// The state that was written down as `stored`: Apply of one change that has all of it.
absl::StatusOr<SessionState> StateOf(const StoredSession& stored);

// Of the steps that were written down, those of points that the session still has.
std::vector<store::v1::StepRecord::Points> PointsOf(const std::vector<store::v1::StepRecord>& steps);

// That of the last mesh; before it, that of the parameters. Valid as long as `state`.
SessionBox BoxOf(const SessionState& state);

// "sessions/{session}/operations/{number}".
std::string NameOfOperation(const SessionState& state, uint64_t number);
// The record of the operation of this number, which is there.
std::shared_ptr<const store::v1::OperationRecord> RecordOfOperation(const SessionState& state, uint64_t number);

bool HasLabels(const SessionState& state, const std::map<std::string, std::string>& labels);

// The sets of sizes that `state` has and that are of no use once only `steps`, and the set `current`, are there.
std::vector<SizesInUse> UnusedSizes(const SessionState& state, const SessionSteps& steps, uint64_t current);

// The revision once the session has `points`, all that were appended.
uint64_t RevisionWith(const SessionState& state, uint64_t points);

// The revision that the work makes which has the session to itself: no other change makes one meanwhile.
uint64_t NextRevision(const SessionState& state);

// Refuses a change that was asked for at another revision. `points`: those that were appended. `expected` 0: any.
//
// Errors:     REVISION_MISMATCH.
absl::Status CheckRevision(const SessionState& state, uint64_t points, uint64_t expected);
// Whether there is a mesh.
//
// Errors:     MESH_NOT_READY.
absl::Status CheckMesh(const SessionState& state);
// Whether there are steps that Replay can take.
//
// Errors:     MESH_NOT_READY.
absl::Status CheckSteps(const SessionState& state);
// Whether there is a structure to query now: such steps, and the mesher that they have made.
//
// Errors:     MESH_NOT_READY.
absl::Status CheckStructure(const SessionState& state, bool has_mesher);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_STATE_H_
