// The simplices of one vertex, as Polytope::FindStar tells them and StarLists keeps them.
#ifndef WELLSPACE_CORE_CELL_STAR_H_
#define WELLSPACE_CORE_CELL_STAR_H_

#include <array>
#include <vector>

#include "core/base/ids.h"

namespace wellspace::core {

// The simplices at a vertex: of each the D other vertices.
template <int D>
using Star = std::vector<std::array<VertexId, D>>;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_STAR_H_
