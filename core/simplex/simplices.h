// The mesh as the union of the stars of its vertices. The mesher calls it to extract a mesh and to bring one up to
// date.
#ifndef WELLSPACE_CORE_SIMPLEX_SIMPLICES_H_
#define WELLSPACE_CORE_SIMPLEX_SIMPLICES_H_

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/voronoi/query_structure.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

struct Simplices {
  // simplex_count x (D + 1) output indices, row-major; positively oriented, lowest vertex first.
  HugeVector<uint32_t> indices;
  double max_radius_edge = 0;
  double min_angle_deg = std::numeric_limits<double>::infinity();
  QueryCounters counters;
};

// Each simplex once, in the order of the vertices along the Z curve of the tree, which threads share out in blocks:
// simplices that each vertex lists; or, if `stars` is not complete, the nodes of its whole cell where it has the lowest
// output index of them.
//
// Shapes:     output_index: vertex_count entries, a permutation: the index in the output of each vertex.
// REQUIRES:   `structure` refined: no circumcentre outside the box; `stars` those of the refinement that has refined
//             it, which has been told of all vertices added or moved since.
// Guarantees: (1) a Delaunay triangulation of the vertices that decomposes the box; (2) the same order for any number
//             of threads.
// Complexity: O(m) for m vertices in a refined structure; no leaf is looked at if `stars` is complete.
// Errors:     RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores.
// Source:     [HT08] §1 and §2; the lists, and the entries that count: docs/design/simplex.md.
template <int D>
absl::StatusOr<Simplices> ComputeSimplices(const QueryStructure<D>& structure, const StarLists<D>& stars,
                                           std::span<const uint32_t> output_index, int threads, RunContext& context);

// The vertices whose stars an insertion of the vertices from `first_new` on can have changed: these, and all that now
// share a simplex with one. (A vertex without a new neighbour has the cell that it had.) Ascending.
//
// Complexity: O(1) for each new vertex in a refined structure.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::StatusOr<std::vector<VertexId>> ChangedVertices(const QueryStructure<D>& structure, VertexId first_new,
                                                      const RunContext& context);

// The simplices all of whose vertices are among `vertices`, each emitted by its vertex with the lowest output index, as
// nodes of that vertex's whole cell; otherwise as ComputeSimplices.
//
// REQUIRES:   `vertices` ascending.
// Complexity: O(vertices), and a bit for each vertex of the structure.
template <int D>
absl::StatusOr<Simplices> ComputeSimplicesAmong(const QueryStructure<D>& structure, std::span<const VertexId> vertices,
                                                std::span<const uint32_t> output_index, int threads,
                                                RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_SIMPLICES_H_
