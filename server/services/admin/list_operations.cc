#include "server/services/admin/list_operations.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/services/page_token.h"
#include "server/services/session_fields.h"
#include "server/sessions/operation.h"
#include "server/sessions/session_changes.h"
#include "server/sessions/session_registry.h"
#include "server/store/session_log.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Most rows of the database that are looked at for a page.
constexpr size_t kMostRows = 1000;

// The place of an operation in the list: that of its session, and its number.
using Place = std::pair<uint64_t, uint64_t>;

// A page that is being filled.
class Page {
 public:
  Page(const v1::ListAllOperationsRequest& request, size_t count, std::string list,
       v1::ListAllOperationsResponse& response)
      : request_(request), count_(count), list_(std::move(list)), response_(response) {}

  bool IsOf(const std::string& tenant) const { return request_.tenant().empty() || request_.tenant() == tenant; }

  // Takes an operation at `position`, if it is wanted. False: the page is full, and the next one begins with it.
  bool Take(v1::OwnedOperation operation, const Place& position) {
    const v1::Operation::State state = operation.operation().state();
    if (IsOf(operation.tenant()) &&
        (request_.state() == v1::Operation::STATE_UNSPECIFIED || request_.state() == state)) {
      bytes_ += operation.ByteSizeLong();
      const bool is_full = response_.operations_size() == static_cast<int>(count_) || bytes_ > kMaxPageBytes;
      if (is_full && response_.operations_size() > 0) {
        GoOnAfterLast();
        return false;
      }
      *response_.add_operations() = std::move(operation);
    }
    last_ = position;
    return true;
  }

  // The next page begins behind what was looked at.
  void GoOnAfterLast() {
    response_.set_next_page_token(
        MakePageToken(list_, absl::StrCat(PositionOf(last_.first), PositionOf(last_.second))));
  }

 private:
  const v1::ListAllOperationsRequest& request_;
  const size_t count_;
  const std::string list_;
  v1::ListAllOperationsResponse& response_;
  size_t bytes_ = 0;
  Place last_;
};

// Positions are times of creation and numbers: no two sessions of a process have the same.
void ListThoseHere(const CallEnvironment& environment, const Place& after, Page& page) {
  std::vector<std::shared_ptr<Session>> sessions = environment.sessions.All();
  std::erase_if(sessions, [&](const std::shared_ptr<Session>& session) {
    return !page.IsOf(session->tenant()) || session->IsElsewhere() || session->IsExpired();
  });
  const auto place = [](const std::shared_ptr<Session>& session) {
    return static_cast<uint64_t>(absl::ToUnixNanos(session->create_time()));
  };
  std::ranges::sort(sessions, {}, place);
  for (const std::shared_ptr<Session>& session : sessions) {
    if (place(session) < after.first) {
      continue;
    }
    const uint64_t after_number = place(session) == after.first ? after.second : 0;
    for (const std::shared_ptr<Operation>& operation : session->ListOperations(after_number, kKeptOperations)) {
      v1::OwnedOperation owned;
      *owned.mutable_operation() = operation->Describe();
      owned.set_tenant(session->tenant());
      if (!page.Take(std::move(owned), {place(session), operation->number()})) {
        return;
      }
    }
  }
}

// Positions are rows of sessions and numbers.
absl::Status ListThoseOfAll(const CallEnvironment& environment, const Place& after, Page& page) {
  const OperationPlace from{.session = static_cast<int64_t>(after.first), .number = after.second};
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<StoredOperation> rows,
                             environment.session_log.records().ListOperations(from, kMostRows));
  for (const StoredOperation& row : rows) {
    v1::OwnedOperation owned;
    *owned.mutable_operation() =
        Operation::Describe(absl::StrCat(row.session, "/operations/", row.operation.number()), row.operation);
    owned.set_tenant(row.tenant);
    owned.set_replica(row.owner);
    owned.set_address(row.address);
    if (!page.Take(std::move(owned), {static_cast<uint64_t>(row.place.session), row.place.number})) {
      return absl::OkStatus();
    }
  }
  if (rows.size() == kMostRows) {
    page.GoOnAfterLast();
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ListAllOperations(const CallEnvironment& environment, const v1::ListAllOperationsRequest& request,
                               v1::ListAllOperationsResponse& response) {
  WELLSPACE_RETURN_IF_ERROR(CheckTenant(request.tenant()));
  if (!v1::Operation::State_IsValid(request.state())) {
    return MakeError(
        v1::ERROR_REASON_INVALID_REQUEST,
        absl::StrCat("state is ", static_cast<int>(request.state()), "; expected one of Operation.State, or none"),
        "state");
  }
  WELLSPACE_ASSIGN_OR_RETURN(const size_t count, PageSizeOf(request));
  const std::string list = absl::StrCat("all operations ", static_cast<int>(request.state()), " ", request.tenant());
  WELLSPACE_ASSIGN_OR_RETURN(const std::string position, PositionFromProto(request.page_token(), list));
  const size_t half = position.size() / 2;
  const Place after = {NumberAt(position.substr(0, half)).value_or(0), NumberAt(position.substr(half)).value_or(0)};
  Page page(request, count, list, response);
  if (environment.session_log.records().is_shared()) {
    return ListThoseOfAll(environment, after, page);
  }
  ListThoseHere(environment, after, page);
  return absl::OkStatus();
}

}  // namespace wellspace::server
