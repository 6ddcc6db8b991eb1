#include "server/sessions/point_account.h"

#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {

StoredAmount TenantPoints::amount() const {
  std::lock_guard lock(mutex_);
  return amount_;
}

TenantPoints::Taken TenantPoints::Take(const StoredAmount& more, const StoredAmount& limits,
                                       const std::function<bool()>& reserve) {
  std::lock_guard lock(mutex_);
  const StoredAmount all = {.points = amount_.points + more.points, .bytes = amount_.bytes + more.bytes};
  if (all.points > limits.points) {
    return {.outcome = Outcome::kTooManyPoints, .amount = all};
  }
  if (more.bytes > 0 && all.bytes > limits.bytes) {
    return {.outcome = Outcome::kTooManyBytes, .amount = all};
  }
  if (!reserve()) {
    return {.outcome = Outcome::kNoRoom, .amount = all};
  }
  amount_ = all;
  return {.outcome = Outcome::kTaken, .amount = all};
}

void TenantPoints::Return(const StoredAmount& amount) {
  std::lock_guard lock(mutex_);
  amount_.points -= amount.points;
  amount_.bytes -= amount.bytes;
}

PointAccount::PointAccount(std::string session, int dimension, bool in_memory, const ServiceOptions& options,
                           MemoryBudget& memory, std::shared_ptr<TenantPoints> tenant)
    : session_(std::move(session)),
      bytes_per_point_(in_memory ? dimension * sizeof(double) : 0),
      dimension_(dimension),
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

StoredAmount PointAccount::Limits() const {
  const uint64_t bytes = options_.max_stored_bytes_per_tenant;
  return {.points = options_.max_points_per_tenant, .bytes = bytes == 0 ? std::numeric_limits<uint64_t>::max() : bytes};
}

StoredAmount PointAccount::MoreOf(const Held& held) const {
  const StoredAmount now = AmountOf(held_);
  const StoredAmount then = AmountOf(held);
  return {.points = then.points - now.points, .bytes = then.bytes - now.bytes};
}

absl::Status PointAccount::AboveBytes(const StoredAmount& would_be, uint64_t more, const char* what) const {
  return MakeError(v1::ERROR_REASON_STORAGE_QUOTA_EXCEEDED,
                   absl::StrCat("your sessions keep ", would_be.bytes - more, " bytes, and ", what, " of ", session_,
                                " would take ", more, " more; they may keep at most ", Limits().bytes,
                                ". What frees some: DeleteSession, RemovePoints, SetSizes without samples"));
}

absl::Status PointAccount::Grow(const Held& held, const char* what) {
  const auto reserve = [&] { return reserved_.Resize(BytesOf(held)); };
  const StoredAmount more = MoreOf(held);
  const TenantPoints::Taken taken = tenant_->Take(more, Limits(), reserve);
  switch (taken.outcome) {
    case TenantPoints::Outcome::kTaken:
      held_ = held;
      return absl::OkStatus();
    case TenantPoints::Outcome::kTooManyPoints:
      return MakeError(v1::ERROR_REASON_QUOTA_EXCEEDED,
                       absl::StrCat("your sessions would have ", taken.amount.points, " ", what,
                                    " together; they may have at most ", options_.max_points_per_tenant));
    case TenantPoints::Outcome::kTooManyBytes:
      return AboveBytes(taken.amount, more.bytes, absl::StrCat("the new ", what).c_str());
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

absl::Status PointAccount::TakeFeatures(const FeatureCounts& counts) {
  Held held = held_;
  held.features = held.features + counts;
  WELLSPACE_RETURN_IF_ERROR(CheckOne(held.features.segments, "segments"));
  WELLSPACE_RETURN_IF_ERROR(CheckOne(held.features.triangles, "triangles"));
  WELLSPACE_RETURN_IF_ERROR(CheckOne(held.features.seeds, "seeds"));
  return Grow(held, "points, segments, triangles and seeds");
}

absl::Status PointAccount::TakeSizes(uint64_t count) {
  Held held = held_;
  held.sizes += count;
  return Grow(held, "points, segments, triangles, seeds and sizes");
}

absl::Status PointAccount::CheckMesh(uint64_t bytes) const {
  const uint64_t more = bytes > held_.mesh_bytes ? bytes - held_.mesh_bytes : 0;
  const StoredAmount then = {.points = 0, .bytes = tenant_->amount().bytes + more};
  return is_closed_ || more == 0 || then.bytes <= Limits().bytes ? absl::OkStatus()
                                                                 : AboveBytes(then, more, "the mesh");
}

absl::Status PointAccount::TakeMesh(uint64_t bytes) {
  if (is_closed_ || bytes <= held_.mesh_bytes) {
    return absl::OkStatus();
  }
  Held held = held_;
  held.mesh_bytes = bytes;
  const StoredAmount more = MoreOf(held);
  // It takes no points, however many there may be, and memory of its own.
  const StoredAmount limits = {.points = std::numeric_limits<uint64_t>::max(), .bytes = Limits().bytes};
  const TenantPoints::Taken taken = tenant_->Take(more, limits, [] { return true; });
  if (taken.outcome != TenantPoints::Outcome::kTaken) {
    return AboveBytes(taken.amount, more.bytes, "the mesh");
  }
  held_ = held;
  return absl::OkStatus();
}

void PointAccount::SettleMesh(uint64_t bytes) {
  Held held = held_;
  held.mesh_bytes = is_closed_ ? held.mesh_bytes : bytes;
  Shrink(held);
}

void PointAccount::Restore(const Held& held) {
  held_ = held;
  constexpr uint64_t kNone = std::numeric_limits<uint64_t>::max();
  (void)tenant_->Take(AmountOf(held_), {.points = kNone, .bytes = kNone}, [] { return true; });
  (void)reserved_.Resize(BytesOf(held_));  // where there is no room, they count with the next that come
}

void PointAccount::Shrink(const Held& held) {
  if (!is_closed_) {
    const StoredAmount now = AmountOf(held_);
    const StoredAmount then = AmountOf(held);
    tenant_->Return({.points = now.points - then.points, .bytes = now.bytes - then.bytes});
  }
  held_ = held;
  (void)reserved_.Resize(BytesOf(held_));  // shrinking never fails
}

void PointAccount::Return(uint64_t count) {
  Held held = held_;
  held.points -= count;
  Shrink(held);
}

void PointAccount::ReturnFeatures(const FeatureCounts& counts) {
  Held held = held_;
  held.features = held.features - counts;
  Shrink(held);
}

void PointAccount::ReturnSizes(uint64_t count) {
  Held held = held_;
  held.sizes -= count;
  Shrink(held);
}

void PointAccount::Close() {
  if (!std::exchange(is_closed_, true)) {
    tenant_->Return(AmountOf(held_));
  }
}

}  // namespace wellspace::server
