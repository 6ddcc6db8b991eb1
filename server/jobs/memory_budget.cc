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

uint64_t MemoryBudget::passing() const {
  std::lock_guard lock(mutex_);
  return reserved_ - lasting_;
}

absl::StatusOr<MemoryReservation> MemoryBudget::Reserve(uint64_t bytes, const std::string& what) {
  if (!Take(bytes, /*lasting=*/false)) {
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

bool MemoryBudget::Take(uint64_t bytes, bool lasting) {
  std::lock_guard lock(mutex_);
  if (bytes > limit_ - reserved_) {
    return false;
  }
  reserved_ += bytes;
  lasting_ += lasting ? bytes : 0;
  return true;
}

void MemoryBudget::Release(uint64_t bytes, bool lasting) {
  {
    std::lock_guard lock(mutex_);
    reserved_ -= bytes;
    lasting_ -= lasting ? bytes : 0;
  }
  Notify();
}

void MemoryBudget::MakeLasting(uint64_t bytes) {
  {
    std::lock_guard lock(mutex_);
    lasting_ += bytes;
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
    lasting_ = std::exchange(other.lasting_, false);
  }
  return *this;
}

bool MemoryReservation::Resize(uint64_t bytes) {
  if (bytes > bytes_) {
    if (!budget_->Take(bytes - bytes_, lasting_)) {
      return false;
    }
  } else if (bytes < bytes_) {
    budget_->Release(bytes_ - bytes, lasting_);
  }
  bytes_ = bytes;
  return true;
}

MemoryReservation MemoryReservation::Split(uint64_t bytes) {
  MemoryReservation part;
  part.budget_ = budget_;
  part.bytes_ = std::min(bytes, bytes_);
  part.lasting_ = lasting_;
  bytes_ -= part.bytes_;
  return part;
}

void MemoryReservation::MakeLasting() {
  if (budget_ != nullptr && !lasting_) {
    lasting_ = true;
    budget_->MakeLasting(bytes_);
  }
}

void MemoryReservation::Release() {
  if (budget_ != nullptr) {
    if (bytes_ > 0) {
      budget_->Release(bytes_, lasting_);
    }
    bytes_ = 0;
    budget_ = nullptr;
  }
}

}  // namespace wellspace::server
