#include "server/sessions/occupancy.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {

absl::Status Elsewhere(const std::string& session, const std::string& address) {
  return SessionElsewhereError(address.empty()
                                   ? absl::StrCat(session, " has been taken over by another server; ask that one")
                                   : absl::StrCat(session, " is at another server, ", address, "; ask that one"),
                               session.substr(session.find('/') + 1), address);
}

absl::Status NoSuchSession(const std::string& session) {
  return MakeError(v1::ERROR_REASON_SESSION_NOT_FOUND,
                   absl::StrCat("there is no ", session, "; it may have been deleted, or have expired"));
}

absl::Status CheckOpen(const Occupancy& occupancy, const std::string& session) {
  if (occupancy.is_elsewhere) {
    return Elsewhere(session, occupancy.owner_address);
  }
  return occupancy.is_closed
             ? MakeError(v1::ERROR_REASON_SESSION_NOT_FOUND,
                         absl::StrCat(session, " does not exist any more: it was deleted, or has expired"))
             : absl::OkStatus();
}

absl::Status CheckIdle(const Occupancy& occupancy, const SessionState& state) {
  const std::string& session = state.name();
  WELLSPACE_RETURN_IF_ERROR(CheckOpen(occupancy, session));
  const auto busy = [](const std::string& what) { return MakeError(v1::ERROR_REASON_SESSION_BUSY, what); };
  switch (occupancy.busy) {
    case Busy::kNo:
      return absl::OkStatus();
    case Busy::kStarting:
      return busy(absl::StrCat("an operation of ", session, " is being started"));
    case Busy::kOperation:
      return busy(absl::StrCat(NameOfOperation(state, state.operations.back()->number()),
                               " is under way; wait for its end, or cancel it"));
    case Busy::kAddingVertices:
      return busy(absl::StrCat("vertices are being added to ", session));
    case Busy::kRemovingPoints:
      return busy(absl::StrCat("points are being removed from ", session));
    case Busy::kReplaying:
      break;
  }
  return busy(absl::StrCat("a query or an addition of vertices has the structure of ", session,
                           " built again, which was given up; try again later"));
}

absl::Status CheckReady(const Occupancy& occupancy, const SessionState& state, uint64_t points,
                        uint64_t expected_revision) {
  WELLSPACE_RETURN_IF_ERROR(CheckIdle(occupancy, state));
  return CheckRevision(state, points, expected_revision);
}

}  // namespace wellspace::server
