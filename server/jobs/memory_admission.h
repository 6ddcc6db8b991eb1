// The admission of jobs to memory, decided by nothing but the figures of one moment.
//
// This is the safety check of the banker's algorithm (E. W. Dijkstra, EWD 623). A state is safe if all jobs that wait
// could go on one after the other, each with the memory that those before it have freed. RoomForTree says how much a
// further job may take so that the state stays safe. The banker of the algorithm knows the claims of all customers in
// advance; here the claim of a job is known once its tree is built. So jobs whose trees were begun together may still
// wait for one another, and VictimOfDeadlock says which of them is refused then.
#ifndef WELLSPACE_SERVER_JOBS_MEMORY_ADMISSION_H_
#define WELLSPACE_SERVER_JOBS_MEMORY_ADMISSION_H_

#include <cstdint>
#include <limits>
#include <optional>
#include <span>

namespace wellspace::server {

// The figures of the memory of one job. All sizes are in bytes.
struct JobMemory {
  uint64_t sequence = 0;    // jobs are numbered in the order of their submission
  bool is_waiting = false;  // it has begun, and waits for memory
  bool has_all = false;     // its run was given more than its tree: it is expected to end with that
  uint64_t wanted = 0;      // bytes that its run is to have in all; while it waits
  uint64_t run = 0;         // bytes that its run has: its tree, or all
  uint64_t freed = 0;       // bytes that will be free once the job has ended
  uint64_t of_call = 0;     // bytes that its call has reserved, which waits for the job
};

inline constexpr uint64_t kNoBound = std::numeric_limits<uint64_t>::max();

// Whether a run may ever have `bytes`, of which it has `own_kept` already: sessions keep `kept` of `limit` whatever
// others want, and nothing says when they end.
bool FitsBesideSessions(uint64_t bytes, uint64_t own_kept, uint64_t kept, uint64_t limit);

// The most that a tree may take, for good, so that those of `begun`, all jobs that have begun, that wait with their
// trees can go on one after the other, the least need first. `unreserved` are the bytes of no reservation.
//
// Guarantees: (1) kNoBound if no job waits with its tree; (2) kNoBound, too, if one of them could not go on even when
//             all jobs that run had ended: a bound would not help it.
// Complexity: O(b log b) for b jobs.
uint64_t RoomForTree(uint64_t unreserved, std::span<const JobMemory> begun);

// If `queued`, all jobs in the queue, and the calls that wait for them, will free whatever work can free, nothing would
// ever change: then the job to refuse, by its sequence. It is the youngest that waits with memory, or the youngest if
// none does. Otherwise nothing. `passing` are the bytes reserved, but not by sessions.
//
// REQUIRES:   no job runs.
std::optional<uint64_t> VictimOfDeadlock(uint64_t passing, std::span<const JobMemory> queued);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_MEMORY_ADMISSION_H_
