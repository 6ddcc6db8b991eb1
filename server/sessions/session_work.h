// What a session hands to the work of an operation, and gets back.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_WORK_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_WORK_H_

#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include "core/mesher.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/mesh_deltas.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

// What an operation works on. While it runs, the mesher is its alone; the mesh is shared, and never changed.
struct SessionWork {
  MemoryReservation memory;              // of `mesher`; first, so that it is given back when that is freed
  std::unique_ptr<core::Mesher> mesher;  // null: there is none yet, or it was given up
  uint64_t meshed_points = 0;            // how many of the session's points `mesher` has, or would have
  std::shared_ptr<MeshSnapshot> mesh;    // the last mesh; null before the first
};

// How the work of an operation has ended.
struct WorkResult {
  absl::Status status;
  SessionWork work;                    // what BeginWork gave; on an error its mesher is as it was, or null
  std::shared_ptr<MeshSnapshot> mesh;  // the new mesh, if the status is OK
  MeshDeltas::Delta delta{};           // from the last mesh to it; null: not made
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_WORK_H_
