// The solid of a surface in which each tetrahedron of a mesh lies.
#ifndef WELLSPACE_CORE_SIMPLEX_SOLID_LABELS_H_
#define WELLSPACE_CORE_SIMPLEX_SOLID_LABELS_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/exact_measure.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {

// The circumcentre of a tetrahedron, by which it has its solid. Two tetrahedra with a common facet are in one solid if
// and only if the edge of cells between these points, the dual of the facet, does not change solids.
//
// Guarantees: (1) the order of the corners does not change a bit.
// Complexity: O(1).
Point<3> LabelledPoint(Simplex<3> corners);

// Labels each tetrahedron by the solid in which its circumcentre lies.
//
// Shapes:     points: n x 3, row-major; simplices: m x 4 indices of points, row-major; the result: m solids.
// REQUIRES:   points have the coordinates that the triangles of `index` have; indices are below n; volumes are not 0.
// Guarantees: (1) neither the order of the corners of a tetrahedron, nor that of points or triangles changes its label;
//             (2) facets between tetrahedra of different labels bound each solid without a gap, whatever the rounding
//             of circumcentres: there is one label for a tetrahedron.
// Complexity: O(m), and the triangles near each circumcentre.
// Errors:     RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores; the result does not depend on them.
// Source:     docs/design/surfaces.md.
absl::StatusOr<HugeVector<uint32_t>> LabelSimplices(const SurfaceIndex& index, std::span<const double> points,
                                                    std::span<const uint32_t> simplices, int threads,
                                                    const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_SOLID_LABELS_H_
