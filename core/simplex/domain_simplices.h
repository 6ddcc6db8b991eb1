// The triangles of a refined domain in the plane, each with its face, as ComputeSimplices finds them in a box.
// PlaneMesher calls it at the end of Refine.
#ifndef WELLSPACE_CORE_SIMPLEX_DOMAIN_SIMPLICES_H_
#define WELLSPACE_CORE_SIMPLEX_DOMAIN_SIMPLICES_H_

#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/refine/plane/planar_domain.h"
#include "core/simplex/simplices.h"
#include "core/voronoi/query_structure.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

struct DomainSimplices {
  Simplices simplices;
  HugeVector<uint32_t> faces;  // by simplex: the face that it lies in
  // Subsegments whose ends are not joined by an edge of the triangulation: by their place in the chains. The simplices
  // are none then.
  std::vector<uint32_t> broken;
};

// The Delaunay triangles of all vertices in the faces of `domain` that are meshed, in the order of the vertices along
// the Z curve: those that `star_lists` has, if these are complete, and turn out to be exactly the triangles of the
// domain; else by the cells of all vertices. Which face a triangle is in follows from subsegments at it, or from the
// order of the neighbours around a vertex: no point is located. Calls drop_stars() when the lists are needed no more,
// so that they can give up their memory; not if they have not been of use.
//
// Shapes:     output_index: as for ComputeSimplices.
// REQUIRES:   `structure` refined in `domain`; `chains` those of the domain; `star_lists` of that refinement.
// Complexity: O(m) for m vertices.
// Errors:     as ComputeSimplices.
// Threads:    uses `threads`, at most as many as the machine has cores.
// Source:     docs/design/features.md.
absl::StatusOr<DomainSimplices> ComputeDomainSimplices(const QueryStructure<2>& structure, const PlanarDomain& domain,
                                                       const PlanarDomain::Chains& chains,
                                                       const StarLists<2>& star_lists,
                                                       absl::FunctionRef<void()> drop_stars,
                                                       std::span<const uint32_t> output_index, int threads,
                                                       RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_DOMAIN_SIMPLICES_H_
