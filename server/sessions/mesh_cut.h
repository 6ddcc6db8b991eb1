// A mesh of a session that is cut into parts, and one part of it.
#ifndef WELLSPACE_SERVER_SESSIONS_MESH_CUT_H_
#define WELLSPACE_SERVER_SESSIONS_MESH_CUT_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/mesh/mesh.h"
#include "core/partition/mesh_part.h"
#include "core/partition/partition.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/kept_products.h"
#include "server/store/mesh_snapshot.h"
#include "server/store/part_snapshot.h"

namespace wellspace::server {

// A mesh, the part of each of its simplices, and who owns what.
struct MeshCut {
  MemoryReservation memory;  // first, so that it is given back when all else is freed
  uint64_t revision = 0;
  core::PartitionOptions options;
  std::shared_ptr<const core::Mesh> mesh;  // the snapshot's own, or a copy
  core::HugeVector<uint32_t> part_of;
  core::PartOwners owners;

  core::PartitionedMesh View() const;
};

// The cuts of one session's mesh: for a few numbers of parts.
using SessionCuts = KeptProducts<MeshCut>;
inline constexpr size_t kMostCuts = 4;

// Cuts `mesh`, in `job`, on this thread. Waits for its memory, all of which is reserved before the work.
//
// `lasts`: how long memory is reserved for it.
// REQUIRES:   1 <= options.parts <= core::kMaxParts, and as many simplices.
// Guarantees: the same mesh and options give the same parts.
// Complexity: as of core::Partition; the bytes of the mesh are read.
// Errors:     INVALID_REQUEST: more simplices than METIS can number; MEMORY_LIMIT, OUT_OF_MEMORY, CANCELLED, DATA_LOSS.
absl::StatusOr<std::shared_ptr<const MeshCut>> CutIntoParts(const MeshSnapshot& mesh,
                                                            const core::PartitionOptions& options, Lasts lasts,
                                                            Job& job);

// The part that a download wants.
struct WantedPart {
  uint32_t part = 0;
  uint32_t ghost_layers = 0;
  bool with_boundary = false;
};

// Takes a part out of `mesh`, which `cut` is of, in `job`, on this thread. Waits for its memory: what it takes to mark
// the part in the mesh, then what the part takes.
//
// REQUIRES:   wanted.part < cut.options.parts.
// Complexity: O(n + m) for each layer of ghosts.
// Errors:     MEMORY_LIMIT, CANCELLED, DATA_LOSS.
absl::StatusOr<std::shared_ptr<const PartSnapshot>> TakePart(const MeshCut& cut, const MeshSnapshot& mesh,
                                                             const WantedPart& wanted, Job& job);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_MESH_CUT_H_
