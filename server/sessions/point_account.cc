#include "server/sessions/point_account.h"

#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {

uint64_t TenantPoints::points() const {
  std::lock_guard lock(mutex_);
  return points_;
}

TenantPoints::Taken TenantPoints::Take(uint64_t count, uint64_t limit, const std::function<bool()>& reserve) {
  std::lock_guard lock(mutex_);
  const uint64_t all = points_ + count;
  if (all > limit) {
    return {.outcome = Outcome::kAboveLimit, .points = all};
  }
  if (!reserve()) {
    return {.outcome = Outcome::kNoRoom, .points = all};
  }
  points_ = all;
  return {.outcome = Outcome::kTaken, .points = all};
}

void TenantPoints::Return(uint64_t count) {
  std::lock_guard lock(mutex_);
  points_ -= count;
}

PointAccount::PointAccount(std::string session, int dimension, bool in_memory, const ServiceOptions& options,
                           MemoryBudget& memory, std::shared_ptr<TenantPoints> tenant)
    : session_(std::move(session)),
      bytes_per_point_(in_memory ? dimension * sizeof(double) : 0),
      bytes_per_size_((dimension + 1) * sizeof(double)),
      options_(options),
      memory_(memory),
      tenant_(std::move(tenant)),
      reserved_(memory.ReserveNothing()) {
  reserved_.MakeLasting();
}

absl::Status PointAccount::CheckOne(uint64_t count, const char* what) const {
  return count <= options_.max_points
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_TOO_MANY_POINTS,
                         absl::StrCat(session_, " would have ", count, " ", what,
                                      "; a session of this server has at most ", options_.max_points));
}

absl::Status PointAccount::Grow(const Held& held, const char* what) {
  const auto reserve = [&] { return reserved_.Resize(BytesOf(held)); };
  const TenantPoints::Taken taken =
      tenant_->Take(held.count() - held_.count(), options_.max_points_per_tenant, reserve);
  switch (taken.outcome) {
    case TenantPoints::Outcome::kTaken:
      held_ = held;
      return absl::OkStatus();
    case TenantPoints::Outcome::kAboveLimit:
      return MakeError(v1::ERROR_REASON_QUOTA_EXCEEDED,
                       absl::StrCat("your sessions would have ", taken.points, " ", what,
                                    " together; they may have at most ", options_.max_points_per_tenant));
    case TenantPoints::Outcome::kNoRoom:
      break;
  }
  return memory_.Refusal(BytesOf(held), absl::StrCat("the ", what, " of a session"));
}

absl::Status PointAccount::Take(uint64_t count) {
  Held held = held_;
  held.points += count;
  WELLSPACE_RETURN_IF_ERROR(CheckOne(held.points, "points"));
  return Grow(held, "points");
}

absl::Status PointAccount::TakeFeatures(uint64_t segments, uint64_t seeds) {
  Held held = held_;
  held.segments += segments;
  held.seeds += seeds;
  WELLSPACE_RETURN_IF_ERROR(CheckOne(held.segments, "segments"));
  WELLSPACE_RETURN_IF_ERROR(CheckOne(held.seeds, "seeds"));
  return Grow(held, "points, segments and seeds");
}

absl::Status PointAccount::TakeSizes(uint64_t count) {
  Held held = held_;
  held.sizes += count;
  return Grow(held, "points, segments, seeds and sizes");
}

void PointAccount::Restore(const Held& held) {
  held_ = held;
  (void)tenant_->Take(held_.count(), std::numeric_limits<uint64_t>::max(), [] { return true; });
  (void)reserved_.Resize(BytesOf(held_));  // where there is no room, they count with the next that come
}

void PointAccount::Shrink(const Held& held) {
  if (!is_closed_) {
    tenant_->Return(held_.count() - held.count());
  }
  held_ = held;
  (void)reserved_.Resize(BytesOf(held_));  // shrinking never fails
}

void PointAccount::Return(uint64_t count) {
  Held held = held_;
  held.points -= count;
  Shrink(held);
}

void PointAccount::ReturnFeatures(uint64_t segments, uint64_t seeds) {
  Held held = held_;
  held.segments -= segments;
  held.seeds -= seeds;
  Shrink(held);
}

void PointAccount::ReturnSizes(uint64_t count) {
  Held held = held_;
  held.sizes -= count;
  Shrink(held);
}

void PointAccount::Close() {
  if (!std::exchange(is_closed_, true)) {
    tenant_->Return(held_.count());
  }
}

}  // namespace wellspace::server
