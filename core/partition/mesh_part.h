// One part of a partitioned mesh, with the simplices around it that a solver has to know.
#ifndef WELLSPACE_CORE_PARTITION_MESH_PART_H_
#define WELLSPACE_CORE_PARTITION_MESH_PART_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// A mesh that is partitioned: arrays of a core::Mesh or of any other, and the part of each simplex.
struct PartitionedMesh {
  int dimension = 0;
  uint64_t vertex_count = 0;
  std::span<const uint32_t> simplices;  // m x (dimension + 1), row-major
  std::span<const uint32_t> facets{};   // f x dimension: the boundary, or nothing
  std::span<const uint32_t> part_of;    // m parts
};

// The owner of a vertex or facet of a partitioned mesh: the lowest part that has a simplex there. A vertex of no
// simplex is of part 0.
struct PartOwners {
  HugeVector<uint32_t> of_vertices;
  HugeVector<uint32_t> of_facets;
  // By vertex: its number where those of part 0 come first, then those of part 1, and so on, all ascending. A solver
  // has its rows in that order.
  HugeVector<uint32_t> rows;
};

// Finds the owners.
//
// Complexity: O(n + m + parts), and a sort of the facets.
// Errors:     INVALID_ARGUMENT: a facet that is none of a simplex, naming it; CANCELLED, DEADLINE_EXCEEDED; errors of
//             the context's memory, which is asked for before the work.
absl::StatusOr<PartOwners> FindOwners(const PartitionedMesh& mesh, const RunContext& context);

// A part in numbers of its own, which begin at 0.
struct MeshPart {
  // The number in the whole mesh of each vertex: first those that the part owns, then others; both ascending.
  HugeVector<uint32_t> vertices;
  uint64_t own_vertices = 0;
  // The number in the whole mesh of each simplex: first those of the part, ascending; then its ghosts, layer by layer,
  // ascending in each.
  HugeVector<uint32_t> simplices;
  uint64_t own_simplices = 0;
  // The numbers in the whole mesh of the facets that the part owns, ascending.
  HugeVector<uint32_t> facets;
  HugeVector<uint32_t> simplex_corners;  // rows of dimension + 1 of the part's own numbers of vertices
  HugeVector<uint32_t> facet_corners;    // rows of dimension
};

// Takes part `part` out of a mesh, with so many layers of ghosts: a layer has the simplices that have a vertex in
// common with the part and the layers before.
//
// Guarantees: over all parts, each vertex, simplex and facet is owned once.
// Complexity: O(n + m) for each part.
// Errors:     CANCELLED, DEADLINE_EXCEEDED; errors of the context's memory, which is asked for before the work.
absl::StatusOr<MeshPart> TakePart(const PartitionedMesh& mesh, const PartOwners& owners, uint32_t part,
                                  uint32_t ghost_layers, const RunContext& context);

// The peak memory of FindOwners and TakePart, their results included. Unit: bytes.
uint64_t PartOwnersBytes(const PartitionedMesh& mesh);
uint64_t MeshPartBytes(const PartitionedMesh& mesh);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_PARTITION_MESH_PART_H_
