#include "server/store/store_health.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

absl::Status StoreFailed(const absl::Status& cause) {
  return MakeError(v1::ERROR_REASON_STORE_FAILED,
                   absl::StrCat("the server can write nothing down any more: ", std::string(cause.message())));
}

// A file is whole, as far as is known, and closed to the server.
absl::Status NotPermitted(const absl::Status& cause) {
  return MakeError(v1::ERROR_REASON_STORE_FAILED,
                   absl::StrCat(std::string(cause.message()), "; the user that the server runs as needs permission"));
}

}  // namespace

StoreHealth::StoreHealth(std::function<void(const absl::Status& cause)> on_failure, std::shared_ptr<Ballast> ballast)
    : on_failure_(std::move(on_failure)), ballast_(std::move(ballast)) {}

absl::Status StoreHealth::Check() const {
  const std::lock_guard lock(mutex_);
  return cause_.ok() ? absl::OkStatus() : StoreFailed(cause_);
}

absl::Status StoreHealth::CheckRoom() {
  WELLSPACE_RETURN_IF_ERROR(Check());
  const absl::Status filled = ballast_ == nullptr ? absl::OkStatus() : ballast_->Fill();
  return filled.ok() ? absl::OkStatus() : OfOpen(filled);
}

absl::Status StoreHealth::Fail(const absl::Status& cause) {
  {
    const std::lock_guard lock(mutex_);
    if (!cause_.ok()) {
      return StoreFailed(cause_);
    }
    cause_ = cause;
  }
  if (on_failure_) {
    on_failure_(cause);
  }
  return StoreFailed(cause);
}

absl::Status StoreHealth::OfOpen(const absl::Status& cause) {
  return cause.code() == absl::StatusCode::kPermissionDenied ? NotPermitted(cause) : OfWrite(cause);
}

absl::Status StoreHealth::OfWrite(const absl::Status& cause) {
  if (cause.code() == absl::StatusCode::kResourceExhausted) {
    return MakeError(v1::ERROR_REASON_DISK_FULL,
                     absl::StrCat("the server has no room to write this down: ", std::string(cause.message())));
  }
  return Fail(cause);
}

absl::Status ErrorOfRead(const absl::Status& cause) {
  if (cause.code() == absl::StatusCode::kPermissionDenied) {
    return NotPermitted(cause);
  }
  return MakeError(cause.code() == absl::StatusCode::kResourceExhausted ? v1::ERROR_REASON_OUT_OF_MEMORY
                                                                        : v1::ERROR_REASON_FILE_DAMAGED,
                   std::string(cause.message()));
}

}  // namespace wellspace::server
