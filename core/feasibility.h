// What is asked for, on the scale of the computation; and whether any mesh could be that.
#ifndef WELLSPACE_CORE_FEASIBILITY_H_
#define WELLSPACE_CORE_FEASIBILITY_H_

#include <cstddef>
#include <cstdint>
#include <limits>

#include "absl/status/status.h"
#include "core/domain.h"
#include "core/estimate/domain_shape.h"
#include "core/mesh_parameters.h"
#include "core/refine/criteria.h"
#include "core/scaled_samples.h"

namespace wellspace::core {

// The criteria that `parameters` ask for, scaled. What is so large or small that doubles could not tell is no larger or
// smaller in the result than that: nothing of it is 0, infinite or NaN, nor are squares of it. `samples` may have those
// of `parameters`.
//
// REQUIRES:   ValidateParameters(parameters).ok().
template <int D>
MeshCriteria<D> CriteriaIn(const Domain<D>& domain, const MeshParameters& parameters, const ScaledSamples<D>& samples);

// Refuses demands for which it is proved that every mesh of `domain` has more vertices than `parameters` allow.
// `vertices` is how many there are before refinement.
//
// Guarantees: (1) what can be met is not refused.
// Errors:     RESOURCE_EXHAUSTED with the payload kDemandsTooFine: the parameter, about how many vertices it takes, the
//             limit, and the smallest size, or side of the domain, that fits.
template <int D>
absl::Status CheckFeasible(const Domain<D>& domain, const MeshParameters& parameters, const ScaledSamples<D>& samples,
                           uint64_t vertices);

// The largest area that is asked for where it is least, and the seed that asks for it; infinite: none.
struct LargestArea {
  double area = std::numeric_limits<double>::infinity();  // not scaled
  size_t seed = 0;
};

// The same of a domain in the plane, for sizes and largest areas; `area` is the least of these.
//
// Complexity: O(n log n) for n segments; that of LeastVerticesForSizes.
absl::Status CheckFeasible(const DomainShape& shape, const Domain<2>& domain, const MeshParameters& parameters,
                           const ScaledSamples<2>& samples, uint64_t vertices, const LargestArea& area);

// The same for the shape of the domain alone: that of a tree over it is as large.
template <int D>
absl::Status CheckShapeFeasible(const Domain<D>& domain, const MeshParameters& parameters, uint64_t vertices);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEASIBILITY_H_
