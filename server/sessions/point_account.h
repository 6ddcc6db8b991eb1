// The account of a session: its points, features, sizes and bytes, within the limits of its tenant.
#ifndef WELLSPACE_SERVER_SESSIONS_POINT_ACCOUNT_H_
#define WELLSPACE_SERVER_SESSIONS_POINT_ACCOUNT_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "server/base/options.h"
#include "server/inputs/feature_store.h"
#include "server/jobs/memory_budget.h"

namespace wellspace::server {

// The storage that sessions take.
struct StoredAmount {
  uint64_t points = 0;  // each segment, triangle, seed and size counts as one, too
  uint64_t bytes = 0;   // of these and of meshes, wherever they are kept
};

// The storage that all sessions of one tenant take.
//
// Thread safety: thread-safe.
// Invariants: amount() is at most the limits that Take was called with.
class TenantPoints {
 public:
  enum class Outcome { kTaken, kTooManyPoints, kTooManyBytes, kNoRoom };
  struct Taken {
    Outcome outcome;
    StoredAmount amount;  // that there is now, or, if it was not taken, would be
  };

  StoredAmount amount() const;

  // Takes `more` if there is then at most `limits`, and if `reserve` says that there is room for it. It is called with
  // the lock of this held, and may take the lock of a MemoryBudget. No limit of bytes refuses a demand without any.
  //
  // Guarantees: (1) a call without kTaken changes nothing; (2) in no moment do other calls see a refused demand in the
  //             end.
  Taken Take(const StoredAmount& more, const StoredAmount& limits, const std::function<bool()>& reserve);
  // REQUIRES:   no more than amount().
  void Return(const StoredAmount& amount);

 private:
  mutable std::mutex mutex_;
  StoredAmount amount_;  // guarded by mutex_
};

// The points, features, sizes and mesh of one session, counted against four limits: that of a session, which holds for
// points, segments, triangles and seeds each, and for a set of sizes where it comes; those of its tenant, for their
// number and for the bytes of all; and the memory of the server, in which meshes are not counted here.
//
// Thread safety: thread-compatible; accounts of one tenant may be used on different threads.
// Invariants: the tenant's points include all of this account until Close.
class PointAccount {
 public:
  // `session` is the name that errors have. `in_memory`: points take memory; those in a file do not.
  //
  // REQUIRES:   `options` and `memory` outlive this.
  PointAccount(std::string session, int dimension, bool in_memory, const ServiceOptions& options, MemoryBudget& memory,
               std::shared_ptr<TenantPoints> tenant);
  ~PointAccount() { Close(); }
  PointAccount(const PointAccount&) = delete;
  PointAccount& operator=(const PointAccount&) = delete;

  uint64_t points() const { return held_.points; }
  // The bytes that count against the tenant's limit.
  uint64_t stored_bytes() const { return AmountOf(held_).bytes; }

  // Takes `count` more points into the account.
  //
  // REQUIRES:   Close was not called.
  // Guarantees: on an error nothing has changed; an error is due to points that some account has, never to points that
  //             are being refused on another thread.
  // Errors:     TOO_MANY_POINTS, QUOTA_EXCEEDED, STORAGE_QUOTA_EXCEEDED, MEMORY_LIMIT.
  absl::Status Take(uint64_t count);
  // The same for so many more features.
  absl::Status TakeFeatures(const FeatureCounts& counts);

  // The same for `count` more sizes at points.
  absl::Status TakeSizes(uint64_t count);

  // Whether a mesh of so many bytes may come in the place of the one that is there.
  //
  // Errors:     STORAGE_QUOTA_EXCEEDED.
  absl::Status CheckMesh(uint64_t bytes) const;
  // Takes the bytes that it has more than the one that is there. To be followed by SettleMesh.
  absl::Status TakeMesh(uint64_t bytes);
  // The mesh has so many bytes now, no more than were taken.
  void SettleMesh(uint64_t bytes);

  // The amounts that an account holds.
  struct Held {
    uint64_t points = 0;
    FeatureCounts features{};
    uint64_t sizes = 0;  // of all sets that the session keeps
    uint64_t mesh_bytes = 0;

    uint64_t count() const { return points + features.all() + sizes; }
  };
  // The bytes of these amounts that count against the tenant's limit.
  static uint64_t StoredBytesOf(const Held& held, int dimension) {
    return held.points * dimension * sizeof(double) + FeatureBytes(held.features) +
           held.sizes * (dimension + 1) * sizeof(double) + held.mesh_bytes;
  }
  // Takes the amounts of the session before the start of the server, whatever the limits are now. To be called first.
  void Restore(const Held& held);

  // Takes the last `count` points out again.
  //
  // REQUIRES:   count <= points().
  void Return(uint64_t count);
  // The same of features.
  void ReturnFeatures(const FeatureCounts& counts);
  void ReturnSizes(uint64_t count);

  // From now on the points do not count as the tenant's. They keep their memory as long as this lives.
  void Close();

 private:
  // In memory.
  uint64_t BytesOf(const Held& held) const {
    return held.points * bytes_per_point_ + FeatureBytes(held.features) + held.sizes * bytes_per_size_;
  }
  // Wherever it is kept.
  StoredAmount AmountOf(const Held& held) const {
    return {.points = held.count(), .bytes = StoredBytesOf(held, dimension_)};
  }
  StoredAmount Limits() const;
  // The excess of `held` over the amounts in the account. REQUIRES: no amount is less.
  StoredAmount MoreOf(const Held& held) const;
  absl::Status AboveBytes(const StoredAmount& would_be, uint64_t more, const char* what) const;
  // Refuses `count` of `what`, if a session may not have as many.
  absl::Status CheckOne(uint64_t count, const char* what) const;
  // Makes the account hold `held`. REQUIRES: no amount is more than it holds.
  void Shrink(const Held& held);
  // REQUIRES: no less than it has.
  absl::Status Grow(const Held& held, const char* what);

  const std::string session_;
  const uint64_t bytes_per_point_;  // in memory
  const int dimension_;
  const uint64_t bytes_per_size_;
  const ServiceOptions& options_;
  MemoryBudget& memory_;
  const std::shared_ptr<TenantPoints> tenant_;
  bool is_closed_ = false;
  Held held_;
  MemoryReservation reserved_;  // of held_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_POINT_ACCOUNT_H_
