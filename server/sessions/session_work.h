// Data that a session hands to the work of an operation, and gets back.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_WORK_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_WORK_H_

#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/meshers/mesher.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/mesh_deltas.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

// Data that an operation works on. While it runs, the mesher is its alone; the mesh is shared, and never changed.
struct SessionWork {
  MemoryReservation memory;  // of `mesher`; first, so that it is given back when that is freed
  // Of the session's points it has, or would have if it was not given up, those of the steps. Null: there is none yet,
  // or it was given up.
  std::unique_ptr<core::Mesher> mesher;
  std::shared_ptr<MeshSnapshot> mesh;  // the last mesh, for an operation; null before the first

  SessionWork TakeMesher() { return {.memory = std::move(memory), .mesher = std::move(mesher), .mesh = nullptr}; }
};

// The result of an operation's work.
struct WorkResult {
  absl::Status status;
  SessionWork work;                    // that of BeginWork; on an error its mesher is as it was, or null
  std::shared_ptr<MeshSnapshot> mesh;  // the new mesh, if the status is OK
  MeshDeltas::Delta delta{};           // from the last mesh to it; null: not made
  uint64_t new_vertices = 0;           // of the new mesh, those that the last one has not
  absl::Duration processor_time = absl::ZeroDuration();
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_WORK_H_
