#include "server/services/operations/watch_operation_call.h"

#include <utility>

#include "server/services/resource_names.h"

namespace wellspace::server {

WatchOperationCall::~WatchOperationCall() {
  if (operation_ != nullptr) {
    operation_->Unwatch(watch_);
  }
}

void WatchOperationCall::OnBegin() {
  absl::StatusOr<FoundOperation> found = FindOperation(environment(), caller(), name_);
  if (!found.ok()) {
    End(std::move(found).status());
    return;
  }
  use_.emplace(std::move(found->session));
  operation_ = std::move(found->operation);
  watch_ = operation_->Watch(WeakCall(&WatchOperationCall::Wake));
  WriteNext();
}

void WatchOperationCall::Wake() {
  std::lock_guard lock(mutex_);
  WriteNext();
}

std::optional<v1::WatchOperationResponse> WatchOperationCall::NextResponse() {
  if (is_end_sent_) {
    End(absl::OkStatus());
    return std::nullopt;
  }
  // First whether it has ended, here or for this server: after that there are no more events.
  const bool has_ended = operation_->HasEnded() || use_->session().IsElsewhere();
  v1::WatchOperationResponse response;
  if (std::optional<v1::ProgressEvent> event = operation_->EventAfter(after_)) {
    after_ = event->sequence();
    *response.mutable_progress() = *std::move(event);
  } else if (has_ended) {
    absl::StatusOr<v1::Operation> told = use_->session().Tell(*operation_);
    if (!told.ok()) {
      End(std::move(told).status());
      return std::nullopt;
    }
    *response.mutable_operation() = *std::move(told);
    is_end_sent_ = true;
  } else {
    return std::nullopt;
  }
  return response;
}

}  // namespace wellspace::server
