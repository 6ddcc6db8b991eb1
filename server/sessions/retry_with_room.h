// Changes that want memory which idle sessions may have.
#ifndef WELLSPACE_SERVER_SESSIONS_RETRY_WITH_ROOM_H_
#define WELLSPACE_SERVER_SESSIONS_RETRY_WITH_ROOM_H_

#include <cstdint>

#include "absl/status/status.h"
#include "server/jobs/memory_budget.h"
#include "server/wire/errors.h"

namespace wellspace::server {

// Returns `change()`. Where memory has no room for it, it is called once more after idle sessions gave up `bytes`.
//
// REQUIRES:   no lock of a session is held; the thread may wait.
template <typename Change>
absl::Status RetryWithRoom(MemoryBudget& memory, uint64_t bytes, const Change& change) {
  absl::Status made = change();
  return IsMemoryLimit(made) && memory.CanMakeRoom() && memory.MakeRoom(bytes, MemoryBudget::Want::kAllOrNothing)
             ? change()
             : made;
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_RETRY_WITH_ROOM_H_
