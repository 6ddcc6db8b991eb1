// The triangles of a domain from the stars that its refinement has listed. ComputeDomainSimplices tries this first.
#ifndef WELLSPACE_CORE_SIMPLEX_LISTED_DOMAIN_SIMPLICES_H_
#define WELLSPACE_CORE_SIMPLEX_LISTED_DOMAIN_SIMPLICES_H_

#include <cstdint>
#include <optional>
#include <span>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/refine/plane/planar_domain.h"
#include "core/simplex/domain_simplices.h"
#include "core/voronoi/query_structure.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

// The triangles that are listed at vertices, in the same order as those of cells; none if these are not exactly those
// of the domain, since a subsegment is no edge, or a triangle has been spoiled beyond a segment, unseen.
//
// Shapes, complexity, errors and threads are those of ComputeDomainSimplices.
absl::StatusOr<std::optional<DomainSimplices>> ListedDomainSimplices(
    const QueryStructure<2>& structure, const PlanarDomain& domain, const PlanarDomain::Chains& chains,
    const StarLists<2>& star_lists, absl::FunctionRef<void()> drop_stars, std::span<const uint32_t> output_index,
    int threads, RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_LISTED_DOMAIN_SIMPLICES_H_
