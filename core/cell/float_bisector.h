// The bisector that cuts a cell in floats, in the plane and in space.
#ifndef WELLSPACE_CORE_CELL_FLOAT_BISECTOR_H_
#define WELLSPACE_CORE_CELL_FLOAT_BISECTOR_H_

#include "core/base/simd/lanes.h"
#include "core/cell/float_errors.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The bisector to a vertex, in the units of the nodes.
template <int D>
struct FloatBisector {
  float w[D];    // the vector to the vertex
  float offset;  // |w|^2 / 2
  float low;     // the offset, less by what an excess over it may be wrong by at most

  WELLSPACE_INLINE static FloatBisector Of(const Point<D>& normal, double scale, float most_radius) {
    FloatBisector bisector;
    float length_sq = 0;
    for (int axis = 0; axis < D; ++axis) {
      bisector.w[axis] = static_cast<float>(normal[axis] * scale);
      length_sq += bisector.w[axis] * bisector.w[axis];
    }
    bisector.offset = 0.5f * length_sq;
    bisector.low = bisector.offset - (kExcessError<D> * most_radius * __builtin_sqrtf(length_sq) + kUnderflow);
    return bisector;
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_BISECTOR_H_
