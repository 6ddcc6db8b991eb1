// Orders of few items by distance, without branches that the data decide: half of those would be mispredicted.
#ifndef WELLSPACE_CORE_VORONOI_NEARNESS_H_
#define WELLSPACE_CORE_VORONOI_NEARNESS_H_

#include <cstddef>
#include <cstdint>

#include "core/voronoi/lanes.h"

namespace wellspace::core {

// Writes to `order` the numbers of the `count` distances, the smallest first, of equal ones by number.
//
// REQUIRES:   distances aligned to kLanes doubles and padded: those beyond `count` may be read and overwritten.
// Complexity: O(count^2) up to 64, in vectors; else O(count log count).
// Errors:     none.
// Source:     rank sort.
void OrderByDistance(double* distances, size_t count, uint32_t* order, VectorUnit unit = BestVectorUnit());

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_NEARNESS_H_
