// Which solid of a surface each tetrahedron of a mesh lies in, and which the surface cuts.
#ifndef WELLSPACE_CORE_SIMPLEX_SOLID_LABELS_H_
#define WELLSPACE_CORE_SIMPLEX_SOLID_LABELS_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {

struct SolidLabels {
  HugeVector<uint32_t> solid_of;  // by tetrahedron: the solid of its centroid
  HugeVector<uint32_t> cut;       // the tetrahedra that the surface goes through, ascending
};

// Labels tetrahedra by the solids in which their centroids lie.
//
// Shapes:     points: n x 3, row-major; simplices: m x 4 indices of points, row-major.
// REQUIRES:   points have the coordinates that the triangles of `index` have; indices are below n; volumes are not 0.
// Guarantees: (1) a tetrahedron that is not cut lies in its solid, but for what is within 2^-40 of the coordinates of
//             its faces: so the volumes of labels are those of solids but for what is cut; (2) neither the order of the
//             corners of a tetrahedron nor that of the triangles changes its label; (3) a tetrahedron is cut if a
//             triangle goes into it deeper than that, in whichever direction it is measured.
// Complexity: O(m), and the triangles near each.
// Errors:     RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores; the result does not depend on them.
// Source:     docs/design/surfaces.md.
absl::StatusOr<SolidLabels> LabelSimplices(const SurfaceIndex& index, std::span<const double> points,
                                           std::span<const uint32_t> simplices, int threads, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_SOLID_LABELS_H_
