#include "server/jobs/memory_admission.h"

#include <algorithm>
#include <tuple>
#include <vector>

namespace wellspace::server {

bool FitsBesideSessions(uint64_t bytes, uint64_t own_kept, uint64_t kept, uint64_t limit) {
  const uint64_t of_others = kept - std::min(kept, own_kept);
  return bytes <= limit - std::min(of_others, limit);
}

uint64_t RoomForTree(uint64_t unreserved, std::span<const JobMemory> begun) {
  std::vector<const JobMemory*> waiting;  // with their trees
  uint64_t trees = 0;                     // of runs that may want more
  uint64_t ending = 0;                    // of runs that will not
  for (const JobMemory& job : begun) {
    if (!job.is_waiting) {
      (job.has_all ? ending : trees) += job.freed;
    } else if (job.run > 0) {
      waiting.push_back(&job);
    }
  }
  const auto needs = [](const JobMemory* job) { return job->wanted - job->run; };
  std::ranges::sort(waiting, {}, needs);
  uint64_t room = unreserved + ending;
  uint64_t most = kNoBound;
  for (const JobMemory* job : waiting) {
    if (needs(job) > room + trees) {
      return kNoBound;
    }
    most = std::min(most, room - std::min(room, needs(job)));
    room += job->freed;
  }
  return most;
}

std::optional<uint64_t> VictimOfDeadlock(uint64_t passing, std::span<const JobMemory> queued) {
  // By this, the last is refused.
  const auto order = [](const JobMemory& job) { return std::tuple(job.is_waiting && job.freed > 0, job.sequence); };
  uint64_t freed = 0;
  const JobMemory* victim = nullptr;
  for (const JobMemory& job : queued) {
    freed += job.freed + job.of_call;
    if (victim == nullptr || order(job) > order(*victim)) {
      victim = &job;
    }
  }
  return victim != nullptr && passing <= freed ? std::optional(victim->sequence) : std::nullopt;
}

}  // namespace wellspace::server
