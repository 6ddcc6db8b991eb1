// Idle sessions that give up memory for other work.
#ifndef WELLSPACE_SERVER_SESSIONS_IDLE_SESSIONS_H_
#define WELLSPACE_SERVER_SESSIONS_IDLE_SESSIONS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/base/clock.h"
#include "server/jobs/memory_budget.h"
#include "server/observability/work_observer.h"
#include "server/sessions/session_registry.h"

namespace wellspace::server {

// Chooses from `sessions` those that give up memory, so that `missing` bytes become free: their indices, ascending.
//
// Guarantees: (1) together they have `missing` bytes; if all have less, all are chosen or, for kAllOrNothing, none;
//             (2) where they have as much, none of them could be left out; (3) none that is left out was used before
//             the last one of them, unless they are enough without it.
// Complexity: O(s log s) for s sessions.
std::vector<size_t> ChooseIdle(std::span<const Session::Spare> sessions, uint64_t missing, MemoryBudget::Want want);

// Has the sessions of a registry give up their meshers where the budget wants it, the one first that has not been used
// for longest. Each comes back by replay, when it is needed.
//
// Thread safety: thread-safe.
class IdleSessions {
 public:
  // REQUIRES:   all outlive this; no other has the budget's SetGiveUp.
  IdleSessions(const SessionRegistry& sessions, MemoryBudget& memory, WorkObserver& observer, Clock clock = Clock());
  ~IdleSessions();
  IdleSessions(const IdleSessions&) = delete;
  IdleSessions& operator=(const IdleSessions&) = delete;

 private:
  // As MemoryBudget::GiveUp says.
  bool GiveUp(uint64_t missing, MemoryBudget::Want want) const;
  // Has those of `all` give up memory that are chosen now. Returns how much they have freed.
  uint64_t GiveUpOnce(std::span<const std::shared_ptr<Session>> all, uint64_t missing, MemoryBudget::Want want) const;

  const SessionRegistry& sessions_;
  MemoryBudget& memory_;
  WorkObserver& observer_;
  const Clock clock_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_IDLE_SESSIONS_H_
