// Names of the nodes of a cell, whatever their numbers there.
#ifndef WELLSPACE_CORE_REFINE_SPACE_TETRAHEDRON_NAME_H_
#define WELLSPACE_CORE_REFINE_SPACE_TETRAHEDRON_NAME_H_

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/base/ids.h"
#include "core/cell/polytope.h"

namespace wellspace::core {

// A node of a cell by the other vertices of its tetrahedron, ascending; kNoVertex for each that it has not.
using TetrahedronName = std::array<VertexId, 3>;

inline TetrahedronName NameOf(const Polytope<3>& cell, const CellNode<3>& node) {
  TetrahedronName name;
  for (size_t k = 0; k < 3; ++k) {
    const Plane<3>& plane = cell.plane(node.planes[k]);
    name[k] = plane.kind == PlaneKind::kBisector ? plane.vertex : kNoVertex;
  }
  std::sort(name.begin(), name.end());
  return name;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_TETRAHEDRON_NAME_H_
