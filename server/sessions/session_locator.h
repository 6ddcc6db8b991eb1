// A mesh of a session, for points to be located in.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_LOCATOR_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_LOCATOR_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "absl/status/statusor.h"
#include "core/mesh/mesh_locator.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

// A mesh of a session in which points can be located.
struct LocatedMesh {
  MemoryReservation memory;  // first, so that it is given back when the locator is freed
  std::unique_ptr<const core::MeshLocator> locator;
  uint64_t revision = 0;
  uint64_t vertices = 0;
};

// Makes the located mesh of one session when it is first asked for, and keeps it until there is another mesh, or other
// work wants its memory.
//
// Thread safety: thread-safe.
// Invariants: at most one located mesh is kept, and at most one is being made.
class SessionLocator {
 public:
  // The last mesh of the session, or why there is none to locate points in.
  using LastMesh = std::function<absl::StatusOr<std::shared_ptr<const MeshSnapshot>>()>;

  // The kept locator if its mesh is the one that `last_mesh` returns; else `job` makes one, on this thread, a worker's.
  // Callers that come meanwhile wait on their threads: the work that they wait for needs no second worker, since the
  // memory is there at once or refused. Their cancels are seen after that.
  //
  // `lasts`: how long memory is reserved for it.
  // Complexity: O(n log n) for n simplices where it is made, and their bytes are read.
  // Errors:     those of `last_mesh`, which is called with no lock but that of the one who makes it; MEMORY_LIMIT,
  //             CANCELLED, DATA_LOSS.
  absl::StatusOr<std::shared_ptr<const LocatedMesh>> Prepare(const LastMesh& last_mesh, Lasts lasts, Job& job);

  // Keeps `located` from now on, null for none, and hands over the one before, to be freed without a lock.
  std::shared_ptr<const LocatedMesh> Replace(std::shared_ptr<const LocatedMesh> located);

  // Whether Prepare was called for the mesh at `revision`, and for no later one since.
  bool WasAskedFor(uint64_t revision) const;
  // Whether the kept locator is of the mesh at `revision`.
  bool Has(uint64_t revision) const;

  // The bytes that GiveUp would free: 0 while points are being located by the kept locator.
  uint64_t SpareBytes() const;
  // Hands over the kept locator, for the caller to free it without a lock; null where SpareBytes is 0.
  std::shared_ptr<const LocatedMesh> GiveUp();

 private:
  bool IsSpareLocked() const { return kept_ != nullptr && kept_.use_count() == 1; }

  std::mutex making_mutex_;                  // before that of the session, and mutex_; held while one is made
  mutable std::mutex mutex_;                 // after that of the session
  std::shared_ptr<const LocatedMesh> kept_;  // guarded by mutex_; others get it under this alone
  uint64_t asked_for_ = 0;                   // guarded by mutex_; the last revision; 0: none
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_LOCATOR_H_
