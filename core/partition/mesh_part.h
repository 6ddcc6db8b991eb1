// One part of a partitioned mesh, with the simplices around it that a solver has to know.
#ifndef WELLSPACE_CORE_PARTITION_MESH_PART_H_
#define WELLSPACE_CORE_PARTITION_MESH_PART_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/check_at.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"

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

// A part of a mesh, marked in the whole mesh.
struct PartSelection {
  uint32_t part = 0;
  HugeVector<uint16_t> layer_of;   // by simplex: 0 of the part itself, 1, 2, … of its ghosts, kNoLayer of others
  HugeVector<uint8_t> has_vertex;  // by vertex: 1 where a simplex of the part, or a ghost, has it
  uint32_t layers = 0;             // of ghosts that there are
  uint64_t own_simplices = 0;
  uint64_t simplices = 0;  // with the ghosts
  uint64_t own_vertices = 0;
  uint64_t vertices = 0;  // with those that others own
  uint64_t facets = 0;
};

inline constexpr uint16_t kNoLayer = 0xffff;

// Marks part `part` of a mesh, with so many layers of ghosts: a layer has the simplices that have a vertex in common
// with the part and the layers before.
//
// REQUIRES:   ghost_layers < kNoLayer.
// Complexity: O(n + m) for each layer; a look at every simplex, whatever the part's size.
// Errors:     CANCELLED, DEADLINE_EXCEEDED; errors of the context's memory, which is asked for before the work.
absl::StatusOr<PartSelection> SelectPart(const PartitionedMesh& mesh, const PartOwners& owners, uint32_t part,
                                         uint32_t ghost_layers, const RunContext& context);

// Takes a part out of its mesh.
//
// Guarantees: over all parts, each vertex, simplex and facet is owned once.
// Complexity: O(n + m), and a look at every simplex for each layer.
// Errors:     those of SelectPart.
absl::StatusOr<MeshPart> TakePart(const PartitionedMesh& mesh, const PartOwners& owners, const PartSelection& selection,
                                  const RunContext& context);
// Both at once.
absl::StatusOr<MeshPart> TakePart(const PartitionedMesh& mesh, const PartOwners& owners, uint32_t part,
                                  uint32_t ghost_layers, const RunContext& context);

// Fills `taken` with the rows of `values`, of `width` numbers each, that `rows` name; with none if there are no values.
//
// Complexity: O(rows), and their memory.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <typename Values, typename Taken>
absl::Status TakeRows(const Values& values, std::span<const uint32_t> rows, size_t width, const RunContext& context,
                      Taken& taken) {
  taken.clear();
  if (values.empty()) {
    return absl::OkStatus();
  }
  taken.reserve(rows.size() * width);
  for (size_t i = 0; i < rows.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    const auto row = values.begin() + static_cast<ptrdiff_t>(rows[i] * width);
    taken.insert(taken.end(), row, row + static_cast<ptrdiff_t>(width));
  }
  return absl::OkStatus();
}

// How many of `numbers`, which ascend, lie in each of the runs of these lengths, of which the first begins at 0: the
// facets of a part in each part of the boundary.
std::vector<uint64_t> CountInRuns(std::span<const uint64_t> lengths, std::span<const uint32_t> numbers);

// The peak memory of FindOwners, its result included. Unit: bytes; so the following.
uint64_t PartOwnersBytes(uint64_t vertices, uint64_t corners_of_simplices, uint64_t facets);
// That of SelectPart, its result included.
uint64_t PartSelectionBytes(const PartitionedMesh& mesh);
// That of TakePart, its result and the selection included.
uint64_t MeshPartBytes(const PartitionedMesh& mesh, const PartSelection& selection);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_PARTITION_MESH_PART_H_
