// The cube of a node of the tree as scans see it. For query_structure.cc alone, into which all is compiled.
#ifndef WELLSPACE_CORE_VORONOI_CUBE_FROM_H_
#define WELLSPACE_CORE_VORONOI_CUBE_FROM_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/ids.h"
#include "core/base/simd/lane_bits.h"
#include "core/base/simd/lanes.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// The cube of a node as it is seen from a site.
template <int D, size_t kWidth>
class CubeFrom {
 public:
  using Lanes = typename Wide<kWidth>::Lanes;
  static constexpr int kVectors = (D + static_cast<int>(kWidth) - 1) / static_cast<int>(kWidth);
  // A lane for each axis, and lanes of zeros.
  struct Axes {
    Lanes lanes[kVectors] = {};
    WELLSPACE_INLINE Lanes& operator[](int i) { return lanes[i]; }
    WELLSPACE_INLINE const Lanes& operator[](int i) const { return lanes[i]; }
  };

  WELLSPACE_INLINE static void Load(const Point<D>& p, Axes& axes) {
    const auto at = [&](int axis) { return axis < D ? p[axis] : 0.0; };
    for (int i = 0; i < kVectors; ++i) {
      const int axis = i * static_cast<int>(kWidth);
      if constexpr (kWidth == 2) {
        axes[i] = Lanes{at(axis), at(axis + 1)};
      } else {
        axes[i] = Lanes{at(axis), at(axis + 1), at(axis + 2), at(axis + 3)};
      }
    }
  }

  WELLSPACE_INLINE CubeFrom(const Axes& site, const LeafTree<D>& tree, NodeId node) {
    Axes low;
    Load(tree.LowOf(node), low);
    const double side = tree.SideOf(node);
    for (int i = 0; i < kVectors; ++i) {
      below_[i] = low[i] - site[i];
      above_[i] = site[i] - (low[i] + side);
      const Lanes out = below_[i] > above_[i] ? below_[i] : above_[i];
      const Lanes away = out > 0 ? out : Lanes{};
      away_sq_[i] = away * away;
    }
  }

  WELLSPACE_INLINE double DistanceSq() const {
    double sum = 0;
    for (int axis = 0; axis < D; ++axis) {
      sum += away_sq_[axis / kWidth][axis % kWidth];
    }
    return sum;
  }

  // The facets that a straight line from the site may leave the cube by within a distance, by its square: a bit for
  // each.
  WELLSPACE_INLINE uint32_t FacetsWithin(double limit_sq) const {
    limit_sq *= 1 + 0x1p-40;  // beyond a facet distances are rounded otherwise
    const double distance_sq = DistanceSq();
    uint32_t facets = 0;
    for (int i = 0; i < kVectors; ++i) {
      const Lanes others_sq = distance_sq - away_sq_[i];
      const auto within = [&](const Lanes& beyond) __attribute__((always_inline)) {
        return kSpread[Bits<kWidth>((beyond <= 0) & (others_sq + beyond * beyond <= limit_sq))];
      };
      facets |= (within(below_[i]) << FaceIndex(0, false) | within(above_[i]) << FaceIndex(0, true)) << 2 * kWidth * i;
    }
    return facets & ((1u << 2 * D) - 1);
  }

 private:
  // Bits by axis at the places of low facets.
  static constexpr std::array<uint32_t, 1 << kWidth> kSpread = [] {
    std::array<uint32_t, 1 << kWidth> spread{};
    for (uint32_t bits = 0; bits < spread.size(); ++bits) {
      for (uint32_t axis = 0; axis < kWidth; ++axis) {
        spread[bits] |= (bits >> axis & 1) << 2 * axis;
      }
    }
    return spread;
  }();

  Axes below_;  // the low face, seen from the site
  Axes above_;  // the site, seen from the high face
  Axes away_sq_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_CUBE_FROM_H_
