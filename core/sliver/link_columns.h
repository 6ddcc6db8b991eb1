// The neighbours of a vertex that has been taken out, in columns, and which of them belongs to a facet of the hole.
#ifndef WELLSPACE_CORE_SLIVER_LINK_COLUMNS_H_
#define WELLSPACE_CORE_SLIVER_LINK_COLUMNS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/simd/lanes.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Neighbours by where they are from the vertex, numbered from 0 on.
//
// Thread safety: thread-compatible.
class LinkColumns {
 public:
  // The tetrahedron of a facet and neighbour `apex`: the function of LiftedPlane, for points relative to the facet's
  // first vertex.
  struct Tetrahedron {
    uint32_t apex = 0;
    std::array<double, 4> cofactors{};
    double largest = 0;  // coordinate between neighbours
  };

  void Clear();
  // `e`: the neighbour from the vertex, the vertex not being the neighbour.
  void Add(const Point<3>& e, double weight);

  // The neighbour beyond facet (a, b, c), counter-clockwise seen from there, in whose sphere through the facet there is
  // no other one; nothing if doubles leave that in doubt.
  //
  // Complexity: O(neighbours).
  // Errors:     none.
  // Source:     gift wrapping: that sphere has the centre that is the least far beyond the facet.
  std::optional<Tetrahedron> Wrap(uint32_t a, uint32_t b, uint32_t c) const { return Wrap(a, b, c, BestVectorUnit()); }
  // Wrap with that unit, for tests. REQUIRES: Has(unit).
  std::optional<Tetrahedron> Wrap(uint32_t a, uint32_t b, uint32_t c, VectorUnit unit) const;

 private:
  // Neighbours side by side: coordinates, and the squared distance from the vertex less the weight.
  struct Group {
    alignas(kLanes * sizeof(double)) double x[4][kLanes];

    template <size_t kWidth>
    struct Vectors {
      typename Wide<kWidth>::Lanes x, y, z, lift;
    };
    // A vector of them, from lane `from` on, as seen from `origin`.
    template <size_t kWidth>
    WELLSPACE_INLINE Vectors<kWidth> RelativeTo(const std::array<double, 4>& origin, size_t from) const {
      return {LanesAt<kWidth>(x[0], from) - origin[0], LanesAt<kWidth>(x[1], from) - origin[1],
              LanesAt<kWidth>(x[2], from) - origin[2], LanesAt<kWidth>(x[3], from) - origin[3]};
    }
  };

  double at(uint32_t neighbour, int column) const { return groups_[neighbour / kLanes].x[column][neighbour % kLanes]; }
  template <size_t kWidth>
  uint32_t NearestBeyond(const std::array<double, 4>& origin, const Point<3>& normal, const Point<3>& centre,
                         double least) const;
  template <size_t kWidth>
  uint64_t NotSurelyOutside(const std::array<double, 4>& origin, const std::array<double, 4>& cofactors,
                            double bound) const;
  template <size_t kWidth>
  std::optional<Tetrahedron> WrapWith(uint32_t a, uint32_t b, uint32_t c) const;
  std::optional<Tetrahedron> WrapAvx2(uint32_t a, uint32_t b, uint32_t c) const;

  std::vector<Group> groups_;  // the rest of the last is NaN
  uint32_t count_ = 0;
  double largest_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_LINK_COLUMNS_H_
