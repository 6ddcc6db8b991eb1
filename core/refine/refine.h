// Bottom-up refinement: Steiner points until every simplex keeps the bound on its radius-edge ratio.
#ifndef WELLSPACE_CORE_REFINE_REFINE_H_
#define WELLSPACE_CORE_REFINE_REFINE_H_

#include <cstdint>
#include <functional>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

struct RefinementParameters {
  double rho = 0;
  uint64_t max_vertices = 0;
  double min_edge = 0;  // no vertex is added nearer than this to another
};

// Called after each step with the structure as it is then; for tests.
template <int D>
using RefinementObserver = std::function<void(const QueryStructure<D>&)>;

// Adds vertices to `structure` until (1) no Delaunay simplex of the box has circumradius > rho * shortest edge, and (2)
// no Voronoi cell touches a face of the box that its vertex does not lie on, so that the Delaunay triangulation
// decomposes exactly the box.
//
// REQUIRES:   rho at least MinimumRho(D).
// Guarantees: (1) bottom-up: the vertex whose cell is looked at has an edge shorter, up to the ratio of a bucket, than
//             all that wait; (2) deterministic.
// Complexity: O(m) queries for m vertices in the end.
// Errors:     RESOURCE_EXHAUSTED with the bound that was met; CANCELLED, DEADLINE_EXCEEDED. `structure` stays usable.
// Source:     [HT08] Figure 4; see docs/design/core.md.
template <int D>
absl::Status Refine(const RefinementParameters& parameters, QueryStructure<D>& structure, RunContext& context,
                    QueryCounters& counters, const RefinementObserver<D>& observer = nullptr);

extern template absl::Status Refine<2>(const RefinementParameters&, QueryStructure<2>&, RunContext&, QueryCounters&,
                                       const RefinementObserver<2>&);
extern template absl::Status Refine<3>(const RefinementParameters&, QueryStructure<3>&, RunContext&, QueryCounters&,
                                       const RefinementObserver<3>&);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_REFINE_H_
