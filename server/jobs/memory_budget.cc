#include "server/jobs/memory_budget.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/base/options.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

std::string InMegabytes(uint64_t bytes) { return absl::StrFormat("%.1f MB", static_cast<double>(bytes) / 1e6); }

}  // namespace

MemoryBudget::MemoryBudget(uint64_t max_memory_bytes)
    : max_memory_bytes_(max_memory_bytes),
      limit_(max_memory_bytes == 0 ? std::numeric_limits<uint64_t>::max()
                                   : max_memory_bytes - std::min(max_memory_bytes, kProcessMemoryBytes)) {}

uint64_t MemoryBudget::reserved() const {
  std::lock_guard lock(mutex_);
  return reserved_;
}

uint64_t MemoryBudget::lasting() const {
  std::lock_guard lock(mutex_);
  return lasting_;
}

uint64_t MemoryBudget::yielding() const {
  std::lock_guard lock(mutex_);
  return yielding_;
}

uint64_t MemoryBudget::passing() const {
  std::lock_guard lock(mutex_);
  return reserved_ - lasting_;
}

absl::StatusOr<MemoryReservation> MemoryBudget::Reserve(uint64_t bytes, const std::string& what) {
  if (!Take(bytes, Lasts::kWork)) {
    return Refusal(bytes, what);
  }
  return MemoryReservation(this, bytes);
}

MemoryReservation MemoryBudget::ReserveNothing() { return MemoryReservation(this, 0); }

absl::Status MemoryBudget::Refusal(uint64_t bytes, const std::string& what) const {
  std::string message = absl::StrCat(what, " needs ", InMegabytes(bytes), " of memory; this server has ",
                                     InMegabytes(limit_), " for all work");
  if (bytes > limit_) {
    return MemoryLimitError(absl::StrCat(message, ": make it smaller"), /*may_retry=*/false);
  }
  std::lock_guard lock(mutex_);
  absl::StrAppend(&message, ", of which ", InMegabytes(reserved_), " are taken");
  if (lasting_ > 0) {
    absl::StrAppend(&message, ", ", InMegabytes(lasting_), " of them by sessions");
  }
  return MemoryLimitError(absl::StrCat(message, ": try again later"), /*may_retry=*/true);
}

void MemoryBudget::SetReleaseListener(std::function<void()> listener) {
  std::lock_guard lock(listener_mutex_);
  listener_ = std::move(listener);
}

void MemoryBudget::SetGiveUp(GiveUp give_up) {
  std::lock_guard lock(give_up_mutex_);
  give_up_ = std::move(give_up);
}

void MemoryBudget::NoteIdle() {
  if (is_limited()) {
    can_make_room_ = true;
    Notify();
  }
}

bool MemoryBudget::MakeRoom(uint64_t bytes, Want want) {
  const auto unreserved = [this] { return limit_ - reserved(); };
  if (bytes <= unreserved() || !can_make_room_) {
    return bytes <= unreserved();
  }
  std::lock_guard lock(give_up_mutex_);
  if (const uint64_t free = unreserved(); free < bytes) {
    can_make_room_ = false;  // first: a session that becomes idle meanwhile may be overlooked
    if (give_up_ != nullptr && give_up_(bytes - free, want)) {
      can_make_room_ = true;
    }
  }
  return bytes <= unreserved();
}

void MemoryBudget::Count(uint64_t bytes, Lasts lasts, int sign) {
  reserved_ += sign * bytes;
  lasting_ += lasts == Lasts::kWork ? 0 : sign * bytes;
  yielding_ += lasts == Lasts::kUntilWanted ? sign * bytes : 0;
}

bool MemoryBudget::Take(uint64_t bytes, Lasts lasts) {
  std::lock_guard lock(mutex_);
  if (bytes > limit_ - reserved_) {
    return false;
  }
  Count(bytes, lasts, 1);
  return true;
}

void MemoryBudget::Release(uint64_t bytes, Lasts lasts) {
  {
    std::lock_guard lock(mutex_);
    Count(bytes, lasts, -1);
  }
  Notify();
}

void MemoryBudget::Recount(uint64_t bytes, Lasts before, Lasts lasts) {
  {
    std::lock_guard lock(mutex_);
    Count(bytes, before, -1);
    Count(bytes, lasts, 1);
  }
  Notify();
}

void MemoryBudget::Notify() {
  std::lock_guard lock(listener_mutex_);
  if (listener_ != nullptr) {
    listener_();
  }
}

MemoryReservation::MemoryReservation(MemoryReservation&& other) noexcept { *this = std::move(other); }

MemoryReservation& MemoryReservation::operator=(MemoryReservation&& other) noexcept {
  if (this != &other) {
    Release();
    budget_ = std::exchange(other.budget_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
    lasts_ = std::exchange(other.lasts_, Lasts::kWork);
  }
  return *this;
}

bool MemoryReservation::Resize(uint64_t bytes) {
  if (bytes > bytes_) {
    if (!budget_->Take(bytes - bytes_, lasts_)) {
      return false;
    }
  } else if (bytes < bytes_) {
    budget_->Release(bytes_ - bytes, lasts_);
  }
  bytes_ = bytes;
  return true;
}

MemoryReservation MemoryReservation::Split(uint64_t bytes) {
  MemoryReservation part;
  part.budget_ = budget_;
  part.bytes_ = std::min(bytes, bytes_);
  part.lasts_ = lasts_;
  bytes_ -= part.bytes_;
  return part;
}

void MemoryReservation::MakeLasting(Lasts lasts) {
  if (budget_ != nullptr && lasts_ == Lasts::kWork) {
    lasts_ = lasts;
    budget_->Recount(bytes_, Lasts::kWork, lasts);
  }
}

void MemoryReservation::MakeYielding() {
  if (budget_ != nullptr && lasts_ != Lasts::kUntilWanted) {
    budget_->Recount(bytes_, std::exchange(lasts_, Lasts::kUntilWanted), Lasts::kUntilWanted);
  }
}

void MemoryReservation::Release() {
  if (budget_ != nullptr) {
    if (bytes_ > 0) {
      budget_->Release(bytes_, lasts_);
    }
    bytes_ = 0;
    budget_ = nullptr;
  }
}

}  // namespace wellspace::server
