// The quality of one simplex: its radius-edge ratio and its angles.
#ifndef WELLSPACE_CORE_SIMPLEX_QUALITY_H_
#define WELLSPACE_CORE_SIMPLEX_QUALITY_H_

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"

namespace wellspace::core {

struct AngleRange {
  double min_deg = 0;
  double max_deg = 0;
};

// circumcentre - p_0; infinities for a flat simplex.
//
// Units:      input length units.
// REQUIRES:   coordinates of absolute value at most 2^1000.
// Guarantees: (1) the length, and each coordinate up to that length, are within a relative error of 1e-10, however flat
//             the simplex.
// Complexity: O(D 2^D); for a flat one (2-D and 3-D: determinant below 2^-6 of its extent; else where the bound on the
//             rounding says so) O(D^2 2^D) on integers of the bits that the coordinates span.
// Errors:     none.
template <int D>
Point<D> CircumcentreOffset(const Simplex<D>& simplex);

// Circumradius / shortest edge; infinite for a flat simplex or one with two equal corners.
//
// REQUIRES:   coordinates of absolute value at most 2^1000.
// Guarantees: (1) a relative error below 2e-10, up to ratios of 1e150; (2) scaling by a power of two does not change
//             it.
// Complexity: as CircumcentreOffset.
// Errors:     none.
template <int D>
double RadiusEdgeRatio(const Simplex<D>& simplex);

// The smallest and the largest angle of a triangle, or angle between two facets of a simplex (the dihedral angles of a
// tetrahedron), in degrees.
//
// REQUIRES:   coordinates of absolute value at most 2^1000.
// Guarantees: (1) an absolute error below, in 2-D and 3-D, 1e-11 / s^2 degrees, s the sine of the smallest angle of its
//             triangles; from 4-D on 1e-11 / s, s the least over its facets of (D - 1)! volume / (product of the
//             lengths of the edges at its lowest corner); (2) orientation does not matter; (3) a flat simplex has 0 and
//             180.
// Complexity: O(D^4 + D^2 2^D), two arc tangents.
// Errors:     none.
template <int D>
AngleRange Angles(const Simplex<D>& simplex);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_QUALITY_H_
