// The part of one simplex that lies in another, by volume.
#ifndef WELLSPACE_CORE_SIMPLEX_OVERLAP_H_
#define WELLSPACE_CORE_SIMPLEX_OVERLAP_H_

#include "core/geometry/exact_measure.h"

namespace wellspace::core {

// The part of `simplex` that lies in `other`, by volume: it is cut along the facets of the other one.
//
// Guarantees: (1) at least 0, at most 1; (2) 1 if all corners are in `other`, and 0 if all are beyond one of its
//             facets: the signs are those of doubles; (3) of simplices that fill `simplex` without overlaps, the parts
//             add up to 1 but for rounding, however flat it is.
// REQUIRES:   finite coordinates; both are positively oriented.
// Complexity: O(D^4), and O(2^D D) for each cut.
template <int D>
double PartInside(const Simplex<D>& simplex, const Simplex<D>& other);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_OVERLAP_H_
