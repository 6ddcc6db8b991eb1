#include "core/validate/polygon_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kStepsBetweenLooks = 1024;

struct Polygon {
  uint32_t seed = 0;
  double area = 0;
  Box<2> box;
};

// The polygon of a seed: rings that follow each other, the largest around the others.
Polygon PolygonOf(uint32_t number, std::span<const double> points, const Features& features) {
  const FaceSeed& seed = features.seeds[number];
  const auto at = [&](size_t i) { return PointAt<2>(points, features.ends[i]); };
  const size_t begin = 2 * size_t{seed.first_segment};
  const Point<2> origin = at(begin);
  Polygon polygon{.seed = number, .area = 0, .box = {origin, origin}};
  double largest = 0;
  double all = 0;
  double ring = 0;
  const auto end_ring = [&] {
    largest = std::max(largest, std::abs(ring));
    all += std::abs(std::exchange(ring, 0));
  };
  for (size_t i = begin; i < begin + 2 * size_t{seed.segment_count}; i += 2) {
    if (i > begin && features.ends[i] != features.ends[i - 1]) {
      end_ring();
    }
    ring += 0.5 * Cross(Difference<2>(at(i), origin), Difference<2>(at(i + 1), origin));
    polygon.box.Include(BoxOfEnds(at(i), at(i + 1)));
  }
  end_ring();
  polygon.area = 2 * largest - all;
  return polygon;
}

// Places in a tree over both axes by turns, from which they are taken once a polygon has them.
class PlaceTree {
 public:
  explicit PlaceTree(std::span<const Point<2>> places) : places_(places), order_(places.size()), left_(places.size()) {
    for (uint32_t i = 0; i < order_.size(); ++i) {
      order_[i] = i;
    }
    Split(0, order_.size(), 0);
  }

  // Appends those in `box` that have not been taken. `taken` says which have.
  void AppendIn(const Box<2>& box, const std::vector<uint32_t>& taken, std::vector<uint32_t>& found) {
    Visit(0, order_.size(), 0, box, taken, found);
  }

 private:
  void Split(size_t begin, size_t end, int axis) {
    if (begin == end) {
      return;
    }
    const size_t middle = (begin + end) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](uint32_t i, uint32_t j) { return places_[i][axis] < places_[j][axis]; });
    left_[middle] = true;
    Split(begin, middle, 1 - axis);
    Split(middle + 1, end, 1 - axis);
  }

  // Returns whether any is left between `begin` and `end`.
  bool Visit(size_t begin, size_t end, int axis, const Box<2>& box, const std::vector<uint32_t>& taken,
             std::vector<uint32_t>& found) {
    if (begin == end) {
      return false;
    }
    const size_t middle = (begin + end) / 2;
    if (!left_[middle]) {
      return false;
    }
    const uint32_t i = order_[middle];
    const bool is_left = taken[i] == kInNoPolygon;
    if (is_left && box.Contains(places_[i])) {
      found.push_back(i);
    }
    const bool low = places_[i][axis] < box.low[axis] || Visit(begin, middle, 1 - axis, box, taken, found);
    const bool high = places_[i][axis] > box.high[axis] || Visit(middle + 1, end, 1 - axis, box, taken, found);
    return left_[middle] = is_left || low || high;
  }

  const std::span<const Point<2>> places_;
  std::vector<uint32_t> order_;
  std::vector<bool> left_;  // by place in order_: whether any may be left below it
};

}  // namespace

absl::StatusOr<std::vector<uint32_t>> FindPolygonsAround(std::span<const Point<2>> places,
                                                         std::span<const double> points, const Features& features,
                                                         const RunContext& context) {
  std::vector<Polygon> polygons;
  for (uint32_t i = 0; i < features.seeds.size(); ++i) {
    if (features.seeds[i].IsPolygon()) {
      polygons.push_back(PolygonOf(i, points, features));
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
  }
  std::sort(polygons.begin(), polygons.end(),
            [](const Polygon& a, const Polygon& b) { return std::tie(a.area, a.seed) < std::tie(b.area, b.seed); });
  std::vector<uint32_t> found(places.size(), kInNoPolygon);
  PlaceTree tree(places);
  std::vector<uint32_t> near;
  std::vector<bool> is_odd(places.size());
  uint64_t steps = 0;
  for (const Polygon& polygon : polygons) {
    near.clear();
    tree.AppendIn(polygon.box, found, near);
    std::sort(near.begin(), near.end(), [&](uint32_t i, uint32_t j) { return places[i][1] < places[j][1]; });
    const FaceSeed& seed = features.seeds[polygon.seed];
    for (size_t s = seed.first_segment; s < size_t{seed.first_segment} + seed.segment_count && !near.empty(); ++s) {
      std::array<Point<2>, 2> ends = {PointAt<2>(points, features.ends[2 * s]),
                                      PointAt<2>(points, features.ends[2 * s + 1])};
      if (ends[0][1] > ends[1][1]) {
        std::swap(ends[0], ends[1]);
      }
      // The places at heights from its lower end on, below its higher one.
      auto at = std::lower_bound(near.begin(), near.end(), ends[0][1],
                                 [&](uint32_t i, double height) { return places[i][1] < height; });
      for (; at != near.end() && places[*at][1] < ends[1][1]; ++at) {
        if (Orientation<2>({ends[0], ends[1], places[*at]}).sign == Sign::kNegative) {
          is_odd[*at] = !is_odd[*at];
        }
        if (++steps % kStepsBetweenLooks == 0) {
          WELLSPACE_RETURN_IF_ERROR(context.Check());
        }
      }
    }
    for (const uint32_t i : near) {
      if (is_odd[i]) {
        found[i] = polygon.seed;
        is_odd[i] = false;
      }
    }
  }
  return found;
}

}  // namespace wellspace::core
