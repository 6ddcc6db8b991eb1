// Tetrahedra without a volume, between four points on one plane and one circle: taken out of a mesh by flips.
#ifndef WELLSPACE_CORE_SIMPLEX_FLAT_TETRAHEDRA_H_
#define WELLSPACE_CORE_SIMPLEX_FLAT_TETRAHEDRA_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// The altitude, relative to the largest coordinate, up to which a tetrahedron is flat: some thousand units in the last
// place of that. Relative to its longest edge it is kFlatShare.
inline constexpr double kFlatAltitude = 1e-12;
inline constexpr double kFlatShare = 1e-6;

// Removes flat tetrahedra. Two pairs of points that mirror each other are on one plane and one circle, so that rounding
// alone decides on a diagonal between them: above the plane it may be one, below the other, and a flat tetrahedron lies
// between. Where just three tetrahedra are around one of the two diagonals, the flat one among them, that edge goes,
// and two tetrahedra are left. What was Delaunay is Delaunay up to the rounding of these points.
//
// Shapes:     points: n x 3, row-major; simplices: m x 4 indices of points, row-major, positively oriented; solids: m.
//             Both lose a row for each flip; rows keep their order.
// REQUIRES:   each face has at most two tetrahedra.
// Guarantees: (1) the boundary of each solid stays as it is; (2) all tetrahedra stay positively oriented, their lowest
//             vertex first; (3) which tetrahedra come out depends on the coordinates alone, not on any order.
// Complexity: O(m + k log k) for k flat tetrahedra, with few tetrahedra at each of their vertices.
// Errors:     RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
// Returns:    the number of flat tetrahedra that are left.
absl::StatusOr<uint64_t> FlipFlatTetrahedra(std::span<const double> points, HugeVector<uint32_t>& simplices,
                                            HugeVector<uint32_t>& solids, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_FLAT_TETRAHEDRA_H_
