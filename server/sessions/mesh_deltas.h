// The differences between meshes of a session that are kept for downloads.
#ifndef WELLSPACE_SERVER_SESSIONS_MESH_DELTAS_H_
#define WELLSPACE_SERVER_SESSIONS_MESH_DELTAS_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "absl/status/statusor.h"
#include "server/store/delta_snapshot.h"

namespace wellspace::server {

// Differences of which each begins where the one before ends. They are made for clients that have the mesh before: one
// is wanted if that mesh was downloaded, or if another difference leads to it.
//
// Thread safety: thread-safe; its lock is held for no longer than it takes to look.
// Invariants: (1) the last one ends at the session's mesh, or there is none; (2) there are kMost at most, and together
//             they have no more bytes than the mesh, so that a chain of them costs no more than a whole download.
class MeshDeltas {
 public:
  using Delta = std::shared_ptr<const DeltaSnapshot>;
  static constexpr size_t kMost = 128;

  // A client downloads the mesh of this revision.
  void NoteDownload(uint64_t revision);
  // Whether one has, and none has downloaded a later one since.
  bool WasDownloaded(uint64_t revision) const;
  // Whether the difference from the mesh of this revision, which is the last one, is of use.
  bool IsWanted(uint64_t revision) const;

  // The session has another mesh now, of `mesh_bytes`, to which `delta` leads; null: none does. Returns the differences
  // that are not kept any more, to be freed without locks.
  [[nodiscard]] std::vector<Delta> Advance(Delta delta, uint64_t mesh_bytes);

  // The differences from the mesh of revision `since` to that of `revision`, one after the other; none if both are the
  // same.
  //
  // Errors:     DELTA_NOT_KEPT, naming the revisions since which there are some.
  absl::StatusOr<std::vector<Delta>> Between(uint64_t since, uint64_t revision) const;

  // Memory of the differences, in bytes.
  uint64_t memory_bytes() const;
  // Gives all up; their memory is freed with the vector that is returned.
  [[nodiscard]] std::vector<Delta> GiveUp();

 private:
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  std::deque<Delta> deltas_;
  uint64_t memory_bytes_ = 0;
  uint64_t downloaded_ = 0;  // the last revision that was; 0: none
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_MESH_DELTAS_H_
