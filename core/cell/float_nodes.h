// Questions to all nodes of a cell in floats, eight at a time. `Group` is Polygon::Group or Polyhedron::Group:
// lanes beyond the last node are at the site, and so never decide. For polygon.cc and polyhedron.cc, into which all is
// compiled.
#ifndef WELLSPACE_CORE_CELL_FLOAT_NODES_H_
#define WELLSPACE_CORE_CELL_FLOAT_NODES_H_

#include <cstddef>
#include <limits>
#include <span>

#include "core/base/simd/float_lanes.h"
#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"
#include "core/cell/float_errors.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The largest x . w of nodes in groups, of eight vectors w side by side.
template <VectorUnit kUnit, int D, typename Group>
WELLSPACE_INLINE Floats LargestProducts(std::span<const Group> groups, const Floats* w) {
  Floats most = Splat(-std::numeric_limits<float>::infinity());
  for (const Group& group : groups) {
    for (size_t i = 0; i < kFloatLanes; ++i) {
      Floats product = w[D - 1] * group.x[D - 1][i];
      for (int axis = D - 2; axis >= 0; --axis) {
        product = w[axis] * group.x[axis][i] + product;
      }
      most = Max<kUnit>(most, product);
    }
  }
  return most;
}

// The squared distances of the nodes of a group.
template <int D, typename Group>
WELLSPACE_INLINE Floats RadiiSq(const Group& group) {
  Floats radius_sq = Load(group.x[0]) * Load(group.x[0]);
  for (int axis = 1; axis < D; ++axis) {
    radius_sq += Load(group.x[axis]) * Load(group.x[axis]);
  }
  return radius_sq;
}

// Whether some vertex in the cube from `low` to `high`, relative to the site, could cut off a node, as
// Polytope::Reaches has it; nodes are within `radius_bound`.
template <VectorUnit kUnit, int D, typename Group>
WELLSPACE_INLINE bool AreReached(std::span<const Group> groups, float radius_bound, const Point<D>& low,
                                 const Point<D>& high) {
  FloatMask any{};
  const Floats doubt = Splat(kPowerError<D> * radius_bound * radius_bound + kUnderflow);
  for (const Group& group : groups) {
    Floats power{};
    for (int axis = 0; axis < D; ++axis) {
      const Floats x = Load(group.x[axis]);
      const Floats least = Splat(static_cast<float>(low[axis]));
      const Floats most = Splat(static_cast<float>(high[axis]));
      const Floats p = Min<kUnit>(Max<kUnit>(x, least), most);
      power += p * (p - 2 * x);
    }
    any |= IsAtMost<kUnit>(power, doubt);
  }
  return Bits<kUnit>(any) != 0;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_NODES_H_
