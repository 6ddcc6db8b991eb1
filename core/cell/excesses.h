// Excesses of nodes of a cell over a bisector, from 4-D on: NodeColumns::ComputeExcesses, the filter before exact
// decisions. It is apart from node_columns.h since polytope.cc alone compiles it, once for each vector unit.
#ifndef WELLSPACE_CORE_CELL_EXCESSES_H_
#define WELLSPACE_CORE_CELL_EXCESSES_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"
#include "core/cell/node_columns.h"

namespace wellspace::core {

template <int D>
template <size_t kWidth>
WELLSPACE_INLINE bool NodeColumns<D>::ComputeExcesses(const Point<D>& normal, double offset, double length,
                                                      double error) {
  using Lanes = typename Wide<kWidth>::Lanes;
  const Group* group = groups_.data();
  Pack* excesses = excesses_.data();
  uint64_t any = 0;
  size_t left = PaddedCount(count_) / kLanes;
  for (Found* found = found_.data(); left > 0; ++found) {
    const size_t groups = std::min(left, kWordBits / kLanes);
    left -= groups;
    uint64_t maybe = 0;
    uint64_t surely = 0;
    size_t node = 0;
    for (const Group* const end = group + groups; group < end; ++group, ++excesses) {
      for (size_t from = 0; from < kLanes; from += kWidth) {
        Lanes excess = LanesAt<kWidth>(group->x[0], from) * normal[0];
        for (int axis = 1; axis < D; ++axis) {
          excess += LanesAt<kWidth>(group->x[axis], from) * normal[axis];
        }
        excess -= offset;
        // The error of the node times |normal|, and that of the rest (kOffsetError in polytope.cc).
        const Lanes doubt = LanesAt<kWidth>(group->slack, from) * length + error;
        LanesAt<kWidth>(excesses->values, from) = excess;
        maybe |= uint64_t{Bits<kWidth>(excess + doubt >= 0)} << node;
        surely |= uint64_t{Bits<kWidth>(excess > doubt)} << node;
        node += kWidth;
      }
    }
    found->maybe = maybe;
    found->surely = surely;
    any |= found->maybe;
  }
  return any != 0;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_EXCESSES_H_
