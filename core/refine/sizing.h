// How large simplices may be, and where.
#ifndef WELLSPACE_CORE_REFINE_SIZING_H_
#define WELLSPACE_CORE_REFINE_SIZING_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The largest circumradius h(x) that a simplex with circumcentre x may have: a bound everywhere, and smaller ones in
// boxes. A box with bound H asks for max(H, distance to the box), so that every simplex whose circumball meets the box
// keeps H. h is 1-Lipschitz, like the local feature size.
template <int D>
struct SizeField {
  struct Region {
    Box<D> box;
    double max_circumradius = 0;

    bool operator==(const Region&) const = default;
  };

  double max_circumradius = std::numeric_limits<double>::infinity();
  std::vector<Region> regions;

  bool operator==(const SizeField&) const = default;

  // h(x)^2.
  //
  // Complexity: O(regions).
  double AtSq(const Point<D>& x) const {
    double least = max_circumradius * max_circumradius;
    for (const Region& region : regions) {
      least =
          std::min(least, std::max(region.max_circumradius * region.max_circumradius, DistanceSq<D>(x, region.box)));
    }
    return least;
  }

  // The least h(y)^2 with |x y| <= reach.
  //
  // Complexity: O(regions).
  double LeastAroundSq(const Point<D>& x, double reach) const {
    double least = max_circumradius * max_circumradius;
    for (const Region& region : regions) {
      const double bound = std::max(region.max_circumradius, std::sqrt(DistanceSq<D>(x, region.box)) - reach);
      least = std::min(least, bound * bound);
    }
    return least;
  }

  // Has no size be below `least`.
  void RaiseTo(double least) {
    max_circumradius = std::max(max_circumradius, least);
    for (Region& region : regions) {
      region.max_circumradius = std::max(region.max_circumradius, least);
    }
  }

  // Nothing is asked for.
  bool IsUnbounded() const { return regions.empty() && max_circumradius == std::numeric_limits<double>::infinity(); }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SIZING_H_
