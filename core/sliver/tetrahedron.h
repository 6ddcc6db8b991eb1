// The shape of a tetrahedron, measured in a few dozen operations: for the many that are tried.
#ifndef WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_
#define WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_

#include <cmath>

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
// MeasureTetrahedron with that unit, for tests. REQUIRES: Has(unit).
TetrahedronMeasure MeasureTetrahedron(const Simplex<3>& corners, VectorUnit unit);

// The cosine by which a tetrahedron counts. One without an area in doubles has no angles there, and is flat.
inline double FlatnessOf(const TetrahedronMeasure& measure) { return std::isnan(measure.cosine) ? 1 : measure.cosine; }

// Slightly below the cosine of an angle in degrees, and the same on every machine: cosines of different libraries
// differ in the last bit.
double FlatCosine(double degrees);

// As MeasureTetrahedron, but for one that doubles see as flat with the exact circumsphere: four points of a circle,
// rounded, span a volume that doubles do not see, and their sphere is one of a pencil. Without an area in doubles there
// are no angles; then the cosine is 1.
//
// Shapes:     corners: positively oriented.
// Complexity: O(1); exact arithmetic for flat ones.
// Errors:     none.
TetrahedronMeasure MeasureFlatTetrahedron(const Simplex<3>& corners);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_TETRAHEDRON_H_
