// The differences of two meshes of which one was made of the other.
#ifndef WELLSPACE_CORE_MESH_MESH_DELTA_H_
#define WELLSPACE_CORE_MESH_MESH_DELTA_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/mesh/mesh.h"

namespace wellspace::core {

// Rows `begin` to `begin + kept` of the array before, then `added` rows that are new.
struct RowRun {
  uint64_t begin = 0;
  uint64_t kept = 0;
  uint64_t added = 0;

  bool operator==(const RowRun&) const = default;
};

// An array whose rows come in another order, or anew: the runs make it, one behind the other.
struct MovedRows {
  HugeVector<RowRun> runs{};
  HugeVector<uint32_t> added{};  // the new rows
};

// An array whose rows stay where they are: the listed ones, ascending, have new values, and new rows follow the last.
template <typename T>
struct ChangedRows {
  uint64_t rows = 0;  // of the array that it makes; 0: it has none, whatever the base has
  HugeVector<uint32_t> changed{};
  HugeVector<T> values{};  // of these, then of the rows that follow
};

// The changes that make one mesh, `base`, another. Vertices and input points of the base keep their numbers.
struct MeshDelta {
  int dimension = 0;
  // Counts of the base.
  uint64_t base_vertices = 0;
  uint64_t base_simplices = 0;
  // Counts of the mesh that it makes.
  uint64_t vertices = 0;
  uint64_t simplices = 0;

  ChangedRows<double> points{};
  ChangedRows<double> weights{};
  ChangedRows<uint32_t> input_vertex{};
  ChangedRows<uint32_t> vertex_origins{};
  ChangedRows<int32_t> vertex_tags{};
  MovedRows kept_simplices{};
  // Numbers of simplices of the new mesh that are kept, with other regions; then the regions of the new simplices. If
  // the base has no regions, the regions of all.
  ChangedRows<int32_t> simplex_regions{};
  MovedRows kept_facets{};
  MovedRows kept_ridges{};

  // These are whole.
  std::vector<double> domain_low{};
  std::vector<double> domain_high{};
  HugeVector<uint32_t> moved_vertices{};
  std::vector<BoundaryPart> boundary{};
  std::vector<Region> regions{};
  MeshStatistics statistics{};

  // The memory of its arrays.
  uint64_t memory_bytes() const;
};

// The changes that make `base` the mesh `next`. It is small where `next` is an update of `base`, and right for any two
// meshes. One that takes more than `max_bytes` is not made. `simplices`, if not null, are the runs that make the
// simplices of `next`, as Mesher::Update notes them: then only those that change are looked for.
//
// REQUIRES:   both are as Mesher makes them, or with empty arrays of the boundary.
// Guarantees: the arrays that it makes are those of `next` to the bit, in their order.
// Complexity: expected O(n) for n rows of both, and DeltaScratchBytes of memory beside the result.
// Errors:     INVALID_ARGUMENT: meshes of two dimensions; RESOURCE_EXHAUSTED: max_bytes, more rows than 32 bits
//             can number; CANCELLED, DEADLINE_EXCEEDED.
// Threads:    thread-safe.
absl::StatusOr<MeshDelta> DiffMeshes(const Mesh& base, const Mesh& next, const MovedRows* simplices, uint64_t max_bytes,
                                     const RunContext& context);

// The memory of DiffMeshes beside its result, at most: of a table of rows of the base. Unit: bytes.
uint64_t DeltaScratchBytes(uint64_t base_simplices);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_MESH_DELTA_H_
