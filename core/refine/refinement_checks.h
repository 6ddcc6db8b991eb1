// The assertions of the checking build on the refinement at each step. Refinement calls it where kChecks is set
// (checks.h).
#ifndef WELLSPACE_CORE_REFINE_REFINEMENT_CHECKS_H_
#define WELLSPACE_CORE_REFINE_REFINEMENT_CHECKS_H_

#include <cstdint>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/refine/insertion.h"
#include "core/refine/schedule.h"
#include "core/refine/steiner_point.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Aborts with the figures where docs/design/guarantees.md does not hold, as far as that can be seen nearby.
//
// Thread safety: thread-compatible.
template <int D>
class RefinementChecks {
 public:
  // REQUIRES:   `structure` outlives this.
  explicit RefinementChecks(const QueryStructure<D>& structure) : structure_(structure) {}

  // Checks that no vertex is pending below `bucket`, from which `v` was taken, whose cell is `cell`: neighbours in the
  // cell each time, all vertices now and then.
  //
  // Complexity: O(nodes), amortised.
  void CheckOrder(const Schedule& schedule, VertexId v, const Polytope<D>& cell, int bucket);

  // [HT08] Definition 1 at an insertion, before it is made: (1), that the edge is the bucket's, the place, and the
  // empty ball. `candidate` is the point before it was snapped to the boundary. A vertex on a feature may be farther
  // from the vertex that asks than others: the first split of a segment between small angles is in its middle third,
  // however near to its end that vertex is.
  //
  // Complexity: that of a query.
  void CheckInsertion(const StepRules<D>& rules, const Insertion& insertion, const SteinerPoint<D>& candidate,
                      const SteinerPoint<D>& point, bool is_on_feature);

 private:
  const QueryStructure<D>& structure_;
  uint64_t unchecked_ = 0;  // vertices taken from the schedule since all have been looked at
  Workspace<D> workspace_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_REFINEMENT_CHECKS_H_
