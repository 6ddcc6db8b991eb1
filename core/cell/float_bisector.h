// The bisector that cuts a cell in floats, in the plane and in space: the filter before exact decisions.
//
// With b = x . w - least_offset as computed, the exact excess of a node x is at most b, and at least b - 2 (offset -
// least_offset). So a node with b < 0 surely stays, one with b > 2 (offset - least_offset) is surely cut off, and one
// between is in doubt: Polygon::FindKept, Polyhedron::FindRemoved.
#ifndef WELLSPACE_CORE_CELL_FLOAT_BISECTOR_H_
#define WELLSPACE_CORE_CELL_FLOAT_BISECTOR_H_

#include "core/base/simd/lanes.h"
#include "core/cell/float_errors.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The bisector to a vertex, in the units of the nodes.
template <int D>
struct FloatBisector {
  float w[D];          // the vector to the vertex
  float offset;        // |w|^2 / 2
  float least_offset;  // the offset, less the bound on the error of an excess over it (kExcessError)

  // The bisector of the vertex at `normal` from the site, in the units of the input, for a cell whose nodes are within
  // `radius_bound`.
  WELLSPACE_INLINE static FloatBisector Of(const Point<D>& normal, double scale, float radius_bound) {
    FloatBisector bisector;
    float length_sq = 0;
    for (int axis = 0; axis < D; ++axis) {
      bisector.w[axis] = static_cast<float>(normal[axis] * scale);
      length_sq += bisector.w[axis] * bisector.w[axis];
    }
    bisector.offset = 0.5f * length_sq;
    bisector.least_offset =
        bisector.offset - (kExcessError<D> * radius_bound * __builtin_sqrtf(length_sq) + kUnderflow);
    return bisector;
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_BISECTOR_H_
