#include "client/overview.h"

#include <utility>

#include "absl/status/status.h"
#include "core/base/status_macros.h"

namespace wellspace::client {

bool IsOver(OperationState state) {
  return state == OperationState::kSucceeded || state == OperationState::kFailed || state == OperationState::kCancelled;
}

absl::StatusOr<Overview> GetOverview(Client& client, const OverviewOptions& options, const CallOptions& call) {
  Overview overview;
  PageOptions page;
  do {
    WELLSPACE_ASSIGN_OR_RETURN(SessionPage found, client.ListSessions({}, page, call));
    for (Session& session : found.sessions) {
      if (options.busy_alone && session.state != SessionState::kRefining) {
        continue;
      }
      SessionWithOperation one{.session = std::move(session), .operation = std::nullopt};
      if (!one.session.last_operation.empty()) {
        absl::StatusOr<Operation> operation = client.GetOperation(one.session.last_operation, call);
        if (absl::IsNotFound(operation.status())) {
          continue;
        }
        WELLSPACE_RETURN_IF_ERROR(operation.status());
        one.operation = *std::move(operation);
      }
      if (options.busy_alone && (!one.operation.has_value() || IsOver(one.operation->state))) {
        continue;
      }
      if (overview.sessions.size() == options.most) {
        overview.has_more = true;
        return overview;
      }
      overview.sessions.push_back(std::move(one));
    }
    page.page_token = std::move(found.next_page_token);
  } while (!page.page_token.empty());
  return overview;
}

}  // namespace wellspace::client
