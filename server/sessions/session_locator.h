// A mesh of a session, for points to be located in.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_LOCATOR_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_LOCATOR_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "core/mesh/mesh_locator.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/kept_products.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

// A mesh of a session in which points can be located.
struct LocatedMesh {
  MemoryReservation memory;  // first, so that it is given back when the locator is freed
  std::unique_ptr<const core::MeshLocator> locator;
  uint64_t revision = 0;
  uint64_t vertices = 0;
};

// The located mesh of one session.
using SessionLocator = KeptProducts<LocatedMesh>;

// Makes it, in `job`, on this thread. Its memory is there at once or refused.
//
// `lasts`: how long memory is reserved for it.
// Complexity: O(n log n) for n simplices, whose bytes are read.
// Errors:     MEMORY_LIMIT, CANCELLED, DATA_LOSS.
absl::StatusOr<std::shared_ptr<const LocatedMesh>> MakeLocated(const MeshSnapshot& mesh, Lasts lasts, Job& job);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_LOCATOR_H_
