// What a tetrahedron is worth, in a few dozen operations: for the many that are tried.
#ifndef WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_
#define WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_

#include "core/base/simd/lanes.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {

struct TetrahedronMeasure {
  double cosine = 0;       // of the smallest dihedral angle; the larger, the flatter
  double determinant = 0;  // six times the volume
  double radius_sq = 0;    // of the circumsphere
  double edge_sq = 0;      // the shortest
  Point<3> centre{};       // of the circumsphere
};

// Measures a tetrahedron in doubles.
//
// Shapes:     corners: positively oriented.
// Guarantees: (1) for one whose angles are above a degree relative errors are below 1e-12; a flat one may have NaN,
//             which passes for no bound; (2) the same to the bit with every vector unit.
// Complexity: O(1), a square root and a division of four doubles at once.
// Errors:     none.
TetrahedronMeasure MeasureTetrahedron(const Simplex<3>& corners);
// The same with that unit, for tests. REQUIRES: Has(unit).
TetrahedronMeasure MeasureTetrahedron(const Simplex<3>& corners, VectorUnit unit);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_
