// The solids into which the triangles of a complex cut space: which is on which side of a triangle.
#ifndef WELLSPACE_CORE_FEATURES_SOLIDS_H_
#define WELLSPACE_CORE_FEATURES_SOLIDS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_complex.h"

namespace wellspace::core {

// A triangle seen from one of its sides: triangle << 1 | (0: from where its corners are counterclockwise, 1: from
// behind).
using HalfFacet = uint32_t;
constexpr HalfFacet HalfFacetOf(uint32_t triangle, bool from_behind) { return triangle << 1 | (from_behind ? 1 : 0); }

// Invariants: (1) both sides of every triangle have a solid, for good; it is one solid on both sides of a membrane, a
// triangle that bounds nothing.
struct Solids {
  std::vector<uint32_t> solid_of;  // by half-facet
  uint32_t count = 1;              // number 0 is the unbounded one; the others ascend by their lowest vertices
  std::vector<double> volumes;     // by solid; of the unbounded one infinite
  // Whether an odd number of triangles separates a solid from infinity, by solid. Where ways to it differ, the first
  // of them decides.
  std::vector<bool> is_odd;
  uint64_t shells = 0;         // parts of the complex that hang together by edges
  uint64_t membranes = 0;      // triangles with one solid on both sides
  uint64_t contradictory = 0;  // triangles that part solids which is_odd has alike
};

// Finds the solids of `complex`, by exact signs alone.
//
// The half-facets around each edge are sorted by angle; neighbours bound one solid. Of a shell that hangs together with
// no other by edges, a ray from its lowest vertex finds the half-facet that it is seen from.
//
// REQUIRES:   triangles meet in common corners and sides alone (FindTrianglePairs); otherwise the result is of no use.
// Guarantees: (1) neither the order of triangles nor that of points, nor which way a triangle goes, changes which
//             solids there are, and their numbers; (2) volumes are within 2^-48 of the sum of the cones over their
//             facets.
// Complexity: O(m log m), and the triangles that the rays of shells meet.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Source:     docs/design/surfaces.md.
absl::StatusOr<Solids> FindSolids(const SurfaceComplex& complex, const RunContext& context);

// The peak memory of FindSolids. Unit: bytes.
uint64_t SolidsBytes(uint64_t triangles);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SOLIDS_H_
