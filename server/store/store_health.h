// The health of the store: whether it can still write, and its errors for clients.
#ifndef WELLSPACE_SERVER_STORE_STORE_HEALTH_H_
#define WELLSPACE_SERVER_STORE_STORE_HEALTH_H_

#include <functional>
#include <memory>
#include <mutex>

#include "absl/status/status.h"
#include "server/store/ballast.h"

namespace wellspace::server {

// Remembers the first failure after which the contents of the disk are unknown. Nothing is written from then on: the
// kernel takes pages that it could not write for written, so that trying again would succeed without a reason.
//
// Thread safety: thread-safe.
class StoreHealth {
 public:
  // `on_failure` is called once, with the cause, by the thread that meets it; it may be empty. `ballast`: null: none.
  explicit StoreHealth(std::function<void(const absl::Status& cause)> on_failure,
                       std::shared_ptr<Ballast> ballast = nullptr);

  // Errors:     STORE_FAILED, after a failure.
  absl::Status Check() const;

  // To be called before a change that takes up room on the disk.
  //
  // Errors:     STORE_FAILED, after a failure; DISK_FULL, as long as the room left is kept for deletions.
  absl::Status CheckRoom();

  // Notes the failure. Returns STORE_FAILED.
  absl::Status Fail(const absl::Status& cause);

  // The error for clients if a file could not be opened for writing because of `cause`: where writing is not
  // permitted, nothing is doubtful, and others can go on.
  absl::Status OfOpen(const absl::Status& cause);

  // The error for clients if a write, or another change of a file, ended with `cause`: DISK_FULL, or a failure.
  absl::Status OfWrite(const absl::Status& cause);

 private:
  const std::function<void(const absl::Status&)> on_failure_;
  const std::shared_ptr<Ballast> ballast_;  // may be null
  mutable std::mutex mutex_;
  absl::Status cause_;  // guarded by mutex_; ok: none yet
};

// The error for clients if a read ended with `cause`, an error of a FileSystem: FILE_DAMAGED, OUT_OF_MEMORY, or, where
// the server may not read the file, STORE_FAILED.
absl::Status ErrorOfRead(const absl::Status& cause);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_STORE_HEALTH_H_
