// Methods of Session about operations that other servers may do.
#include <utility>

#include "server/sessions/session.h"

namespace wellspace::server {

std::optional<Session::Waiting> Session::GetWaiting() const {
  absl::MutexLock lock(&mutex_);
  if (occupancy_.busy != Busy::kOperation || occupancy_.is_closed) {
    return std::nullopt;
  }
  const Operation& operation = *operations_.back();
  if (!operation.IsQueued() || operation.IsSuspect()) {
    return std::nullopt;
  }
  return Waiting{.operation = operation.name(),
                 .since = absl::FromUnixNanos(operation.Record().create_time_ns()),
                 .is_offered = occupancy_.is_offered,
                 .has_structure = work_.mesher != nullptr,
                 .is_read = meshes_.IsRead()};
}

absl::Status Session::SetOffer(bool stands) {
  absl::MutexLock change_lock(&change_mutex_);  // so that the operation does not begin meanwhile
  if (IsOffered() == stands || !GetWaiting().has_value()) {
    return absl::OkStatus();
  }
  {
    absl::MutexLock lock(&mutex_);
    occupancy_.is_offered = true;  // before another may take it
  }
  SessionChange change = OfferChange(*state(), stands);
  const absl::Status made = Make(change, [&] {
    mutex_.AssertHeld();
    occupancy_.is_offered = stands;
  });
  absl::MutexLock lock(&mutex_);
  if (!made.ok() && stands && !occupancy_.is_elsewhere) {
    occupancy_.is_offered = false;
  }
  return made;
}

bool Session::IsOffered() const {
  absl::MutexLock lock(&mutex_);
  return occupancy_.is_offered;
}

std::shared_ptr<Job> Session::GiveAway(const std::string& address) {
  std::shared_ptr<Operation> waiting;
  {
    absl::MutexLock change_lock(&change_mutex_);
    {
      absl::MutexLock lock(&mutex_);
      if (occupancy_.is_closed && !occupancy_.is_elsewhere) {
        return nullptr;  // this server has deleted it
      }
    }
    NoteElsewhere(address);
    absl::MutexLock lock(&mutex_);
    if (occupancy_.busy == Busy::kOperation && operations_.back()->IsQueued()) {
      waiting = operations_.back();
      occupancy_.EndBusy(clock_.since_boot());
    }
  }
  if (waiting == nullptr) {
    return nullptr;
  }
  waiting->Notify();
  return waiting->job();
}

}  // namespace wellspace::server
