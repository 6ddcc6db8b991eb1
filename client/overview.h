// All sessions of a server, with the operations under way on them.
#ifndef WELLSPACE_CLIENT_OVERVIEW_H_
#define WELLSPACE_CLIENT_OVERVIEW_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "client/client.h"

namespace wellspace::client {

struct SessionWithOperation {
  Session session;
  std::optional<Operation> operation;  // its last one; none before the first
};

struct Overview {
  std::vector<SessionWithOperation> sessions;
  bool has_more = false;  // there are more than were asked for
};

// The choice of the sessions in an overview.
struct OverviewOptions {
  uint64_t most = 1000;
  bool busy_alone = false;  // only those whose operation is queued or running
};

// Whether an operation has ended.
bool IsOver(OperationState state);

// The caller's sessions, in the server's order. A session that goes meanwhile is left out.
//
// Complexity: a call for each page of sessions, and one for each operation.
// Errors:     of the client's calls.
absl::StatusOr<Overview> GetOverview(Client& client, const OverviewOptions& options = {}, const CallOptions& call = {});

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_OVERVIEW_H_
