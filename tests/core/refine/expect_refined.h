// The guarantee of a refinement for a cell, seen by a look at all vertices.
#ifndef WELLSPACE_TESTS_CORE_REFINE_EXPECT_REFINED_H_
#define WELLSPACE_TESTS_CORE_REFINE_EXPECT_REFINED_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/cell/polytope.h"
#include "core/voronoi/query_structure.h"
#include "tests/support/brute_force.h"

namespace wellspace::test {

// Expects the guarantee of Refinement for the whole cell of `v` under radius-edge, by a look at all vertices; ties are
// perturbed, as they are for the simplices.
template <int D>
void ExpectRefined(const core::QueryStructure<D>& structure, core::VertexId v, double rho, core::Polytope<D>& cell) {
  CutByAllInBox<D>(structure, v, cell, core::TieRule::kPerturb);
  for (const core::CellNode<D>& node : cell.nodes()) {
    double shortest = std::numeric_limits<double>::infinity();
    bool is_circumcenter = true;
    for (const uint16_t index : node.planes) {
      const core::Plane<D>& plane = cell.plane(index);
      if (plane.kind == core::PlaneKind::kFace) {
        is_circumcenter = false;
        ASSERT_TRUE((structure.faces(v) >> plane.face) & 1)
            << "the cell of vertex " << Index(v) << " touches face " << int{plane.face};
      } else {
        shortest = std::min(shortest, plane.length);
      }
    }
    if (is_circumcenter) {
      ASSERT_LE(std::sqrt(node.radius_sq), rho * shortest * (1 + 1e-9)) << "at vertex " << Index(v);
    }
  }
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_REFINE_EXPECT_REFINED_H_
