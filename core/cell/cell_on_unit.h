// The common work of Polygon and Polyhedron with the vector unit that there is: cuts by many vertices, and tests of a
// cell's reach. For polygon.cc and polyhedron.cc alone, into which all is compiled.
#ifndef WELLSPACE_CORE_CELL_CELL_ON_UNIT_H_
#define WELLSPACE_CORE_CELL_CELL_ON_UNIT_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/ids.h"
#include "core/base/simd/float_lanes.h"
#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"
#include "core/cell/float_bisector.h"
#include "core/cell/float_candidates.h"
#include "core/cell/float_errors.h"
#include "core/cell/float_nodes.h"
#include "core/cell/float_vertices.h"
#include "core/cell/gathered_vertices.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// `Cell` has the dimension D, and is a FloatCell<D> that this is a friend of. It has groups(), which has the nodes, and
// CutOff<kUnit>(bisector, u, position), which cuts by one vertex.
//
// Each function chooses the unit once. The functions below it are made for that unit, and inlined: a call in between
// would leave the vectors of AVX2.
template <typename Cell, int D>
struct CellOnUnit {
  // As CellClass has CutBeforePlace.
  static bool CutBeforePlace(Cell& cell, VertexId u, const Point<D>& position) {
    const Point<D> normal = Difference<D>(position, cell.site_);
    if (!(NormSq<D>(normal) <= cell.CutLimitSq())) {
      return false;
    }
    const auto bisector = FloatBisector<D>::Of(normal, cell.scale_, cell.radius_bound_);
    return cell.unit_ == VectorUnit::kAvx2 ? CutOffAvx2(cell, bisector, u, position)
                                           : cell.template CutOff<VectorUnit::kBaseline>(bisector, u, position);
  }

  // As CellClass has CutByEach.
  static size_t CutByEach(Cell& cell, std::span<const Point<D>> positions, const VertexNames& names, VertexId site) {
    return cell.unit_ == VectorUnit::kAvx2
               ? CutByEachAvx2(cell, positions, names, site)
               : CutByVertices<VectorUnit::kBaseline>(cell, ContiguousVertices<D>{positions, names}, site);
  }

  // As Polygon::CutByGathered.
  static size_t CutByGathered(Cell& cell, const GatheredVertices<D>& gathered, VertexId site) {
    return cell.unit_ == VectorUnit::kAvx2 ? CutByGatheredAvx2(cell, gathered, site)
                                           : CutByGatheredWith<VectorUnit::kBaseline>(cell, gathered, site);
  }

  // As CellClass has Reaches.
  static bool Reaches(const Cell& cell, const Box<D>& cube) {
    return cell.unit_ == VectorUnit::kAvx2 ? ReachesAvx2(cell, cube) : ReachesWith<VectorUnit::kBaseline>(cell, cube);
  }

 private:
  // Cuts by up to kMostCutTogether vertices, ContiguousVertices or ChosenVertices: picks those that may cut, and cuts
  // by them, the nearest first. Returns how many but the site are within reach.
  template <VectorUnit kUnit, typename Vertices>
  WELLSPACE_INLINE static size_t CutByVertices(Cell& cell, const Vertices& vertices, VertexId site) {
    FloatCandidates<D> candidates;
    candidates.template Pick<kUnit>(
        vertices, site, cell.site_, cell.scale_, cell.radius_bound_,
        [&cell](const Floats* w, const Floats& least_offset, FloatMask& is_near) __attribute__((always_inline)) {
          // Of later leaves most vertices miss the cell, now and ever after: no product x . w of a node is as much as
          // their least offset.
          if (cell.cuts_ != 0 && (D == 2 || Bits<kUnit>(is_near) != 0)) {
            is_near &= IsAtMost<kUnit>(least_offset, LargestProducts<kUnit, D>(cell.groups(), w));
          }
        });
    candidates.CutInOrder(
        [&](const FloatBisector<D>& bisector, size_t slot) __attribute__((always_inline)) {
          return cell.template CutOff<kUnit>(bisector, vertices.name(slot), vertices.position(slot));
        },
        // No offset is as little as -1: a cell that is too large is cut no more.
        [&cell] { return cell.IsTooLarge() ? -1 : OffsetBound<D>(cell.radius_bound_); });
    return candidates.within_reach;
  }

  // Cuts by the gathered vertices that are within the cell's reach: the near ones, after which the reach is mostly
  // final, then those between them and the reach, as often as it takes. Up to kMostCutTogether at a time.
  template <VectorUnit kUnit>
  WELLSPACE_INLINE static size_t CutByGatheredWith(Cell& cell, const GatheredVertices<D>& gathered, VertexId site) {
    alignas(sizeof(FloatMask)) int32_t numbers[GatheredVertices<D>::kMost + kFloatLanes];
    size_t within_reach = 0;
    double limit_sq = std::min(gathered.near_sq(), cell.CutLimitSq());
    for (float more_than_sq = -1;;) {
      const float most_sq = gathered.MostSq(limit_sq);
      const size_t count = ChooseBetween<kUnit, D>(gathered, cell.site(), more_than_sq, most_sq, numbers);
      std::fill_n(numbers + count, kFloatLanes, 0);
      for (size_t i = 0; i < count && !cell.IsTooLarge(); i += kMostCutTogether) {
        const ChosenVertices<D> vertices{gathered, {numbers + i, std::min(count - i, kMostCutTogether)}};
        within_reach += CutByVertices<kUnit>(cell, vertices, site);
      }
      if (cell.IsTooLarge() || cell.CutLimitSq() <= limit_sq) {
        return within_reach;
      }
      limit_sq = cell.CutLimitSq();
      more_than_sq = most_sq;
    }
  }

  template <VectorUnit kUnit>
  WELLSPACE_INLINE static bool ReachesWith(const Cell& cell, const Box<D>& cube) {
    return AreReached<kUnit, D>(cell.groups(), cell.radius_bound_, cell.ScaledTo(cube.low), cell.ScaledTo(cube.high));
  }

  WELLSPACE_AVX2 static bool CutOffAvx2(Cell& cell, const FloatBisector<D>& bisector, VertexId u,
                                        const Point<D>& position) {
    return cell.template CutOff<VectorUnit::kAvx2>(bisector, u, position);
  }
  WELLSPACE_AVX2 static size_t CutByEachAvx2(Cell& cell, std::span<const Point<D>> positions, const VertexNames& names,
                                             VertexId site) {
    return CutByVertices<VectorUnit::kAvx2>(cell, ContiguousVertices<D>{positions, names}, site);
  }
  WELLSPACE_AVX2 static size_t CutByGatheredAvx2(Cell& cell, const GatheredVertices<D>& gathered, VertexId site) {
    return CutByGatheredWith<VectorUnit::kAvx2>(cell, gathered, site);
  }
  WELLSPACE_AVX2 static bool ReachesAvx2(const Cell& cell, const Box<D>& cube) {
    return ReachesWith<VectorUnit::kAvx2>(cell, cube);
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_CELL_ON_UNIT_H_
