// The facets around each vertex of a mesh in the plane.
#ifndef WELLSPACE_CORE_VALIDATE_FACET_FANS_H_
#define WELLSPACE_CORE_VALIDATE_FACET_FANS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <tuple>
#include <vector>

#include "core/geometry/point.h"

namespace wellspace::core {

// The facets that meet at each vertex, in the order of their angles.
//
// Thread safety: thread-compatible; const functions may run at once.
class FacetFans {
 public:
  // A facet, seen from one of its ends.
  struct Way {
    double angle = 0;  // as AngleOf
    uint32_t to = 0;
    uint32_t facet = 0;
  };

  // Shapes:     vertices: n x 2; facets: rows of 2 vertices. `vertices` has to outlive this.
  // Complexity: O(n + m log m).
  FacetFans(std::span<const double> vertices, std::span<const uint32_t> facets)
      : vertices_(vertices), first_(vertices.size() / 2 + 1), ways_(facets.size()) {
    for (const uint32_t v : facets) {
      ++first_[v + 1];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t i = 0; i < facets.size(); ++i) {
      ways_[next[facets[i]]++] = {AngleOf(Difference<2>(At(facets[i ^ 1]), At(facets[i]))), facets[i ^ 1], i / 2};
    }
    for (size_t v = 0; v + 1 < first_.size(); ++v) {
      std::sort(ways_.begin() + first_[v], ways_.begin() + first_[v + 1],
                [](const Way& a, const Way& b) { return std::tie(a.angle, a.to) < std::tie(b.angle, b.to); });
    }
  }

  Point<2> At(uint32_t v) const { return PointAt<2>(vertices_, v); }

  // The facets at `v`, by angle.
  std::span<const Way> Around(uint32_t v) const { return {ways_.data() + first_[v], first_[v + 1] - first_[v]}; }

  // Calls f(way) for the facets at `v` whose directions are next to `direction`: two on both sides at least, or all.
  //
  // Complexity: O(log k), k facets at the vertex.
  template <typename F>
  void ForEachNear(uint32_t v, const Point<2>& direction, const F& f) const {
    constexpr std::ptrdiff_t kOnASide = 4;
    const std::span<const Way> ways = Around(v);
    const auto size = static_cast<std::ptrdiff_t>(ways.size());
    std::ptrdiff_t begin = 0;
    std::ptrdiff_t end = size;
    if (size > 2 * kOnASide) {
      const auto at = std::lower_bound(ways.begin(), ways.end(), AngleOf(direction),
                                       [](const Way& way, double angle) { return way.angle < angle; });
      begin = at - ways.begin() - kOnASide;
      end = begin + 2 * kOnASide;
    }
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      f(ways[static_cast<size_t>((i + size) % size)]);
    }
  }

  // Grows with the angle of a direction, from 0 to 4.
  static double AngleOf(const Point<2>& d) {
    const double part = d[1] / (std::abs(d[0]) + std::abs(d[1]));
    return d[0] < 0 ? 2 - part : d[1] < 0 ? 4 + part : part;
  }

 private:
  const std::span<const double> vertices_;
  std::vector<uint32_t> first_;  // by vertex
  std::vector<Way> ways_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_FACET_FANS_H_
