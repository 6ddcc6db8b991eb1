// Points in cells of a grid.
#ifndef WELLSPACE_CORE_GEOMETRY_POINT_GRID_H_
#define WELLSPACE_CORE_GEOMETRY_POINT_GRID_H_

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Points, of which those near a place are found.
//
// Thread safety: thread-compatible; const functions may run at once.
template <int D>
class PointGrid {
 public:
  // Finds points that are at most `reach` away, in a box.
  PointGrid(const Box<D>& box, double reach) : low_(box.low), per_side_(1 / (2.125 * reach)) {}

  // Point number 0, 1, …
  void Add(const Point<D>& p) {
    const auto [at, is_new] = first_.try_emplace(KeyOf(Lines(p)), kNoPoint);
    next_.push_back(std::exchange(at->second, static_cast<uint32_t>(points_.size())));
    points_.push_back(p);
  }

  const Point<D>& operator[](uint32_t point) const { return points_[point]; }

  // Calls f(point) for all within reach of `p`, and others, until it returns false.
  //
  // Complexity: O(2^D) expected, and O(1) for each point that is visited.
  template <typename F>
  void ForEachNear(const Point<D>& p, F f) const {
    const Point<D> lines = Lines(p);
    Key key = KeyOf(lines);
    std::array<int64_t, D> beside;  // points within reach lie in this column or in that one
    for (int i = 0; i < D; ++i) {
      beside[i] = lines[i] - std::floor(lines[i]) < 0.5 ? -1 : 1;
    }
    for (uint32_t corner = 0; corner < (uint32_t{1} << D); ++corner) {
      Key there = key;
      for (int i = 0; i < D; ++i) {
        there[i] += ((corner >> i) & 1) != 0 ? beside[i] : 0;
      }
      const auto at = first_.find(there);
      for (uint32_t point = at == first_.end() ? kNoPoint : at->second; point != kNoPoint; point = next_[point]) {
        if (!f(point)) {
          return;
        }
      }
    }
  }

 private:
  static constexpr uint32_t kNoPoint = std::numeric_limits<uint32_t>::max();
  using Key = std::array<int64_t, D>;

  // Coordinates in sides of cells: below 2^52, as no reach is below that part of the box.
  Point<D> Lines(const Point<D>& p) const {
    Point<D> lines;
    for (int i = 0; i < D; ++i) {
      lines[i] = (p[i] - low_[i]) * per_side_;
    }
    return lines;
  }
  static Key KeyOf(const Point<D>& lines) {
    Key key;
    for (int i = 0; i < D; ++i) {
      key[i] = static_cast<int64_t>(std::floor(lines[i]));
    }
    return key;
  }

  const Point<D> low_;
  const double per_side_;
  absl::flat_hash_map<Key, uint32_t> first_;  // by cell
  std::vector<uint32_t> next_;                // by point, in its cell
  std::vector<Point<D>> points_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_POINT_GRID_H_
