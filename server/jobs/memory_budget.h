// What the jobs, sessions and calls of a server may hold in memory, all together.
#ifndef WELLSPACE_SERVER_JOBS_MEMORY_BUDGET_H_
#define WELLSPACE_SERVER_JOBS_MEMORY_BUDGET_H_

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace wellspace::server {

class MemoryReservation;

// Counts reservations against a limit. Nothing is allocated here: the holder of a reservation takes care to hold no
// more.
//
// Thread safety: thread-safe. A listener's locks must not be held when bytes are released.
// Invariants: (1) reserved() <= limit(); (2) lasting() <= reserved(); (3) a reservation does not outlive its budget.
class MemoryBudget {
 public:
  // Of `max_memory_bytes` for the whole process, kProcessMemoryBytes are set aside for what is no work. 0: no limit.
  explicit MemoryBudget(uint64_t max_memory_bytes);
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  bool is_limited() const { return max_memory_bytes_ != 0; }
  // Most that all reservations can have together; without a limit, the largest number.
  uint64_t limit() const { return limit_; }
  uint64_t reserved() const;
  // Of that, what sessions keep: it is not freed by itself when work ends.
  uint64_t lasting() const;
  // The rest of it.
  uint64_t passing() const;

  // Sets `bytes` aside for `what`, which the error names: "a call", "the points of a session", …
  //
  // Errors:     MEMORY_LIMIT with the figures, and with RetryInfo when the bytes could be had were other reservations
  //             released.
  absl::StatusOr<MemoryReservation> Reserve(uint64_t bytes, const std::string& what);

  // A reservation of no bytes, to be resized.
  MemoryReservation ReserveNothing();

  // The error of Reserve.
  absl::Status Refusal(uint64_t bytes, const std::string& what) const;

  // `listener` is called after bytes were released, without any lock of the budget held. One at a time; null for none.
  // Returns when no call of the last one is under way.
  void SetReleaseListener(std::function<void()> listener);

 private:
  friend class MemoryReservation;

  // Whether there was room.
  bool Take(uint64_t bytes, bool lasting);
  void Release(uint64_t bytes, bool lasting);
  void MakeLasting(uint64_t bytes);
  void Notify();

  const uint64_t max_memory_bytes_;
  const uint64_t limit_;
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  uint64_t reserved_ = 0;
  uint64_t lasting_ = 0;
  std::mutex listener_mutex_;       // before mutex_
  std::function<void()> listener_;  // guarded by listener_mutex_
};

// Bytes of a budget, given back at the end of its life. Movable; what was moved from has none.
//
// Thread safety: thread-compatible.
class MemoryReservation {
 public:
  MemoryReservation() = default;  // of nothing
  ~MemoryReservation() { Release(); }
  MemoryReservation(MemoryReservation&& other) noexcept;
  MemoryReservation& operator=(MemoryReservation&& other) noexcept;

  uint64_t bytes() const { return bytes_; }
  // Of these, what no session keeps.
  uint64_t passing_bytes() const { return lasting_ ? 0 : bytes_; }

  // Makes it `bytes` large. Growing fails, and changes nothing, where there is no room; shrinking never fails.
  //
  // REQUIRES:   made by a budget, and not released.
  [[nodiscard]] bool Resize(uint64_t bytes);

  // Hands over `bytes` of it, or all that it has.
  MemoryReservation Split(uint64_t bytes);

  // From now on, and for what is added to it, it counts as kept by a session.
  void MakeLasting();

  // Gives all back.
  void Release();

 private:
  friend class MemoryBudget;
  MemoryReservation(MemoryBudget* budget, uint64_t bytes) : budget_(budget), bytes_(bytes) {}

  MemoryBudget* budget_ = nullptr;
  uint64_t bytes_ = 0;
  bool lasting_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_MEMORY_BUDGET_H_
