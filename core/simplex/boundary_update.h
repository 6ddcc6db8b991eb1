// The boundary of a mesh of a box, kept while the mesh is changed.
#ifndef WELLSPACE_CORE_SIMPLEX_BOUNDARY_UPDATE_H_
#define WELLSPACE_CORE_SIMPLEX_BOUNDARY_UPDATE_H_

#include <cstdint>
#include <span>

#include "core/simplex/boundary.h"
#include "core/simplex/row_edits.h"

namespace wellspace::core {

// Brings a boundary up to date after `edits` of the simplices, by which `mesh` has been made, and whose vertices from
// `old_vertices` on are new; `moved` are those that have moved.
//
// REQUIRES:   `boundary` that of the mesh before.
// Guarantees: (1) it is what FindBoxBoundary gives.
// Complexity: O(facets + simplices added + vertices added or moved).
// Errors:     none.
void UpdateBoxBoundary(const BoxMesh& mesh, std::span<const RowEdit> edits, uint64_t old_vertices,
                       std::span<const uint32_t> moved, BoxBoundary& boundary);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_BOUNDARY_UPDATE_H_
