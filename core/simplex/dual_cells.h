// The dual of a mesh: Voronoi cells within the domain, as finite volumes need them.
#ifndef WELLSPACE_CORE_SIMPLEX_DUAL_CELLS_H_
#define WELLSPACE_CORE_SIMPLEX_DUAL_CELLS_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// The Voronoi cell of each vertex, within the domain.
//
// A finite volume scheme with the flux of two points has areas[e] / lengths[e] * (value of the second end of edge e -
// that of the first): the facet between two cells is orthogonal to the edge between their vertices.
struct DualCells {
  // n volumes of the cells, by vertex: areas in 2-D. Their sum is that of the simplices, but for rounding.
  HugeVector<double> volumes;
  // The e edges of the mesh, e x 2 vertices, row-major: each once, the lower vertex first, in ascending order. The
  // cells of the two are neighbours.
  HugeVector<uint32_t> edges;
  // e areas of the facets between these two cells: lengths in 2-D. At least 0 but for rounding; 0 where they meet in
  // less than a facet.
  HugeVector<double> areas;
  HugeVector<double> lengths;  // e lengths of the edges
  // For each facet of the boundary and each of its vertices, f x dimension, the part that the facet has in the area of
  // the vertex' cell on the boundary. In an obtuse triangle it may be negative; over all facets of a vertex the sum is
  // not.
  HugeVector<double> facet_areas;
};

// The input of dual cells: the arrays of a core::Mesh, of a client::Mesh, or of any other.
struct DelaunayMesh {
  int dimension = 0;
  std::span<const double> points;       // n x dimension
  std::span<const uint32_t> simplices;  // m x (dimension + 1), positively oriented
  std::span<const uint32_t> facets{};   // f x dimension: the boundary, or nothing
  std::span<const double> weights{};    // nothing: a regular triangulation has no dual of Voronoi cells
};

// Cells, edges and facets of `mesh` in 2-D and 3-D, each cell made of its parts in the simplices at its vertex.
//
// Units:      lengths, areas and volumes of the input's unit, which leaves edges between 2^-200 and 2^200.
// REQUIRES:   the mesh is Delaunay, fewer than 2^32 simplices; no circumcentre lies outside of the domain. So are all
//             meshes that Mesher makes without weights.
// Guarantees: (1) the parts of a simplex add up to it, however flat it is, but for rounding; (2) each cell is closed:
//             normals of its facets times their areas, those on the domain's boundary included, add up to 0 but for
//             rounding.
// Complexity: O(n + m) time and a sort of each vertex' edges; memory beside the result: 64 bytes a simplex in 3-D, 36
//             in 2-D.
// Errors:     INVALID_ARGUMENT: another dimension; weights; arrays that do not hold whole rows; a vertex that does not
//             exist, or a simplex that is flat, naming the first. CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores; the result does not depend on them.
// Source:     circumcentric duals: M. Desbrun, A. Hirani, M. Leok, J. Marsden, Discrete Exterior Calculus, 2005, §2.
absl::StatusOr<DualCells> FindDualCells(const DelaunayMesh& mesh, int threads, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_DUAL_CELLS_H_
