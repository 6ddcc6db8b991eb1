// The demands on a mesh, on the scale of the computation; and whether any mesh can meet them.
#ifndef WELLSPACE_CORE_MESHERS_FEASIBILITY_H_
#define WELLSPACE_CORE_MESHERS_FEASIBILITY_H_

#include <cstddef>
#include <cstdint>
#include <limits>

#include "absl/status/status.h"
#include "core/estimate/domain_shape.h"
#include "core/input/frame.h"
#include "core/input/mesh_parameters.h"
#include "core/input/scaled_samples.h"
#include "core/refine/criteria.h"

namespace wellspace::core {

// The criteria that `parameters` ask for, scaled, and clamped to the range in which doubles tell them apart: no number
// of them is 0, infinite or NaN, nor are squares of them. Where `samples` has not
// taken the samples of `parameters`, they are scaled here.
//
// REQUIRES:   ValidateParameters(parameters).ok().
template <int D>
MeshCriteria<D> CriteriaIn(const Frame<D>& frame, const MeshParameters& parameters, const ScaledSamples<D>& samples);

// Refuses demands for which it is proved that every mesh of `frame` has more vertices than `parameters` allow.
// `vertices` is how many there are before refinement.
//
// Guarantees: (1) demands that can be met are not refused.
// Errors:     RESOURCE_EXHAUSTED with the payload kDemandsTooFine: the parameter, about how many vertices it takes, the
//             limit, and the smallest size, or side of the domain, that fits.
template <int D>
absl::Status CheckFeasible(const Frame<D>& frame, const MeshParameters& parameters, const ScaledSamples<D>& samples,
                           uint64_t vertices);

// The largest area that is asked for where it is least, and the seed that asks for it; infinite: none.
struct LargestArea {
  double area = std::numeric_limits<double>::infinity();  // not scaled
  size_t seed = 0;
};

// CheckFeasible for a domain in the plane, for sizes and largest areas; `area` is the least of these.
//
// Complexity: O(n log n) for n segments; that of LeastVerticesForSizes.
absl::Status CheckFeasible(const DomainShape& shape, const Frame<2>& frame, const MeshParameters& parameters,
                           const ScaledSamples<2>& samples, uint64_t vertices, const LargestArea& area);

// CheckFeasible for the shape of the domain alone: that of a tree over it is as large.
template <int D>
absl::Status CheckShapeFeasible(const Frame<D>& frame, const MeshParameters& parameters, uint64_t vertices);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_FEASIBILITY_H_
