// The memory that the jobs, sessions and calls of a server may hold, all together.
#ifndef WELLSPACE_SERVER_JOBS_MEMORY_BUDGET_H_
#define WELLSPACE_SERVER_JOBS_MEMORY_BUDGET_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace wellspace::server {

class MemoryReservation;

// The time that memory is reserved for.
enum class Lasts {
  kWork,         // until work ends
  kSession,      // as long as a session wants it
  kUntilWanted,  // as long as a session wants it, unless other work does while the session is idle
};

// Counts reservations against a limit. Nothing is allocated here: the holder of a reservation takes care to hold no
// more.
//
// Thread safety: thread-safe. A listener's locks must not be held when bytes are released.
// Invariants: (1) reserved() <= limit(); (2) yielding() <= lasting() <= reserved(); (3) a reservation does not outlive
//             its budget.
class MemoryBudget {
 public:
  // Of `max_memory_bytes` for the whole process, kProcessMemoryBytes are set aside for the process itself. 0: no limit.
  explicit MemoryBudget(uint64_t max_memory_bytes);
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  bool is_limited() const { return max_memory_bytes_ != 0; }
  // Most that all reservations can have together; without a limit, the largest number.
  uint64_t limit() const { return limit_; }
  uint64_t reserved() const;
  // Of that, the bytes that sessions keep: they are not freed when work ends.
  uint64_t lasting() const;
  // Of lasting memory, the bytes that sessions keep until they are wanted (Lasts::kUntilWanted).
  uint64_t yielding() const;
  // The reserved bytes that do not last.
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

  // `listener` is called after bytes were released, or could be (NoteIdle), without any lock but its own held. One at a
  // time; null for none. Returns when no call of the last one is under way.
  void SetReleaseListener(std::function<void()> listener);

  // The memory that idle sessions give up to MakeRoom if they do not hold enough: none, or all of it.
  enum class Want { kAllOrNothing, kAsMuchAsPossible };
  // Has idle sessions give up memory, `missing` bytes if they can. Says whether idle sessions hold still more.
  using GiveUp = std::function<bool(uint64_t missing, Want want)>;
  // `give_up` is called by MakeRoom, one call at a time; null for none. Returns when no call of the last one is under
  // way.
  void SetGiveUp(GiveUp give_up);

  // A session that has memory to give up may have become idle. No lock of a session or of the pool is to be held.
  void NoteIdle();
  // Whether there may be an idle session with memory that MakeRoom would find.
  bool CanMakeRoom() const { return can_make_room_; }
  // Has idle sessions give up memory until `bytes` are not reserved. Says whether they are free now.
  //
  // REQUIRES:   the caller holds no lock of a session or of the pool, and may wait: large structures are freed.
  // Complexity: that of the sessions that there are; constant where CanMakeRoom() is false.
  bool MakeRoom(uint64_t bytes, Want want);

 private:
  friend class MemoryReservation;

  // Whether there was room.
  bool Take(uint64_t bytes, Lasts lasts);
  void Release(uint64_t bytes, Lasts lasts);
  // Bytes that counted as `before` count as `lasts` from now on.
  void Recount(uint64_t bytes, Lasts before, Lasts lasts);
  // Counts `bytes` more, or, if `sign` is -1, less. Wants mutex_ to be held.
  void Count(uint64_t bytes, Lasts lasts, int sign);
  void Notify();

  const uint64_t max_memory_bytes_;
  const uint64_t limit_;
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  uint64_t reserved_ = 0;
  uint64_t lasting_ = 0;
  uint64_t yielding_ = 0;
  std::mutex listener_mutex_;       // before mutex_
  std::function<void()> listener_;  // guarded by listener_mutex_
  // Before listener_mutex_ and the locks of sessions: held while room is made, so that the next caller finds it.
  std::mutex give_up_mutex_;
  GiveUp give_up_;                          // guarded by give_up_mutex_
  std::atomic<bool> can_make_room_{false};  // a session has become idle since MakeRoom has found none
};

// Bytes of a budget, given back at the end of its life. Movable; one that was moved from has none.
//
// Thread safety: thread-compatible.
class MemoryReservation {
 public:
  MemoryReservation() = default;  // of nothing
  ~MemoryReservation() { Release(); }
  MemoryReservation(MemoryReservation&& other) noexcept;
  MemoryReservation& operator=(MemoryReservation&& other) noexcept;

  uint64_t bytes() const { return bytes_; }
  // Of these, the bytes that no session keeps.
  uint64_t passing_bytes() const { return lasts_ == Lasts::kWork ? bytes_ : 0; }
  // Of these, the bytes that a session keeps whatever others want.
  uint64_t kept_bytes() const { return lasts_ == Lasts::kSession ? bytes_ : 0; }

  // Makes it `bytes` large. Growing fails, and changes nothing, where there is no room; shrinking never fails.
  //
  // REQUIRES:   made by a budget, and not released.
  [[nodiscard]] bool Resize(uint64_t bytes);

  // Hands over `bytes` of it, or all that it has.
  MemoryReservation Split(uint64_t bytes);

  // From now on, and for what is added to it, it counts as kept by a session. One that lasts already stays as it is.
  //
  // REQUIRES:   lasts != Lasts::kWork.
  void MakeLasting(Lasts lasts = Lasts::kSession);

  // From now on a session keeps it until other work wants it, whatever it counted as before.
  void MakeYielding();

  // Gives all back.
  void Release();

 private:
  friend class MemoryBudget;
  MemoryReservation(MemoryBudget* budget, uint64_t bytes) : budget_(budget), bytes_(bytes) {}

  MemoryBudget* budget_ = nullptr;
  uint64_t bytes_ = 0;
  Lasts lasts_ = Lasts::kWork;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_MEMORY_BUDGET_H_
