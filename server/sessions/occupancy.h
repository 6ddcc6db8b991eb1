// The occupancy of a session: the work and the calls that use it.
#ifndef WELLSPACE_SERVER_SESSIONS_OCCUPANCY_H_
#define WELLSPACE_SERVER_SESSIONS_OCCUPANCY_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "server/sessions/lease.h"
#include "server/sessions/session_state.h"

namespace wellspace::server {

// The work that has a session to itself. There is one at most.
enum class Busy { kNo, kStarting, kOperation, kAddingVertices, kRemovingPoints, kReplaying };

// The users of one session of one process: the work that has it to itself, an upload, queries, and calls that keep its
// structure; whether it has been closed, and until when it lives without any of these. Nothing of this is written down.
//
// Thread safety: thread-compatible; the session guards it.
// Invariants: (1) a session that is busy does not expire; (2) queries begin only while no work has the session.
struct Occupancy {
  Lease lease;
  Busy busy = Busy::kNo;
  bool is_closed = false;
  bool is_elsewhere = false;    // another server has taken the session over; it is closed here, too
  std::string owner_address{};  // where that one serves; empty: not known
  bool is_offered = false;      // other servers may take it over now, or have
  bool is_uploading = false;
  int queries = 0;         // batches that run
  int structure_uses = 0;  // while there are any, the mesher is not given up for other work

  // The session is the caller's alone until EndBusy, and does not expire.
  void BeginBusy(Busy work) {
    busy = work;
    lease.BeginUse();
  }
  void EndBusy(absl::Duration now) {
    busy = Busy::kNo;
    lease.EndUse(now);
  }
  // Whether no work and no query needs the structure.
  bool IsIdle() const { return busy == Busy::kNo && structure_uses == 0; }
};

// For absl::Condition: to be waited for by work that has made the session busy, so that no query begins.
inline bool HasNoQueries(Occupancy* occupancy) { return occupancy->queries == 0; }

// Refuses requests that a closed session does not serve any more.
//
// Errors:     SESSION_NOT_FOUND, SESSION_ELSEWHERE.
absl::Status CheckOpen(const Occupancy& occupancy, const std::string& session);
// The error of every call to a session that another server owns. `address`: that server's; empty: unknown.
absl::Status Elsewhere(const std::string& session, const std::string& address = "");
// The error of every call to a session that does not exist, or is another tenant's.
absl::Status NoSuchSession(const std::string& session);
// CheckOpen; also refuses requests that have to wait for the work that has the session.
//
// Errors:     SESSION_NOT_FOUND, SESSION_BUSY.
absl::Status CheckIdle(const Occupancy& occupancy, const SessionState& state);
// CheckIdle; also refuses a change that was asked for at another revision. `points`: all appended. `expected_revision`
// 0: any.
//
// Errors:     SESSION_NOT_FOUND, SESSION_BUSY, REVISION_MISMATCH.
absl::Status CheckReady(const Occupancy& occupancy, const SessionState& state, uint64_t points,
                        uint64_t expected_revision);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_OCCUPANCY_H_
