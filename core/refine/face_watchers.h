// Vertices on faces of the box that must look again once a vertex is added near them, by place.
#ifndef WELLSPACE_CORE_REFINE_FACE_WATCHERS_H_
#define WELLSPACE_CORE_REFINE_FACE_WATCHERS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/ids.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Watchers are hashed by cubes: one that reaches as far as r by its cube of the grid whose sides are the least power of
// two above r, so that all points within r are in that cube and those beside it.
//
// Thread safety: thread-compatible.
template <int D>
class FaceWatchers {
 public:
  // Adds `v` at `p`, which watches the points within `reach`, or all if that is infinite.
  //
  // REQUIRES:   v is none yet; reach > 0.
  // Complexity: O(1), amortised.
  void Add(VertexId v, const Point<D>& p, double reach) {
    const int level = std::isinf(reach) ? kEverywhere : std::ilogb(reach) + 1;
    const Cube cube = CubeOf(p, level);
    cubes_.emplace(v, cube);
    if (level != kEverywhere) {
      watchers_[cube].push_back({v, p, reach * reach});
    }
    ++levels_[level];
  }

  // Removes `v` if it is one.
  void Remove(VertexId v) {
    const auto own = cubes_.find(v);
    if (own == cubes_.end()) {
      return;
    }
    if (const auto at = watchers_.find(own->second); at != watchers_.end()) {
      std::erase_if(at->second, [v](const Watcher& watcher) { return watcher.vertex == v; });
      if (at->second.empty()) {
        watchers_.erase(at);
      }
    }
    if (const auto at = levels_.find(own->second.first); --at->second == 0) {
      levels_.erase(at);
    }
    cubes_.erase(own);
  }

  void Clear() { *this = {}; }

  // Whether a vertex that shares a face with `x` watches it; others may count, too. `faces` are those of x.
  //
  // Complexity: O(3^D) look-ups for each power of two that some vertex reaches as far as; on one face O(3^(D - 1)).
  bool IsWatched(const Point<D>& x, FaceMask faces) const {
    for (const auto& [level, count] : levels_) {
      if (level == kEverywhere || HasBeside(CubeOf(x, level), 0, x, faces)) {
        return true;
      }
    }
    return false;
  }

  uint64_t MemoryBytes() const {
    return watchers_.capacity() * sizeof(std::pair<Cube, std::vector<Watcher>>) +
           cubes_.capacity() * sizeof(std::pair<VertexId, Cube>);
  }

 public:
  // The binary logarithm of the side, and the place in units of it.
  using Cube = std::pair<int, std::array<double, D>>;
  struct Watcher {
    VertexId vertex;
    Point<D> position;
    double reach_sq;
  };
  static constexpr int kEverywhere = std::numeric_limits<int>::max();

  static Cube CubeOf(const Point<D>& p, int level) {
    Cube cube{level, {}};
    for (int i = 0; i < D && level != kEverywhere; ++i) {
      cube.second[i] = std::floor(std::ldexp(p[i], -level));
    }
    return cube;
  }

  // Looks for watchers of `x` in the cubes beside one along `axis` and those after it. Those of a point on one face are all
  // as far along its axis.
  bool HasBeside(Cube cube, int axis, const Point<D>& x, FaceMask faces) const {
    if (axis == D) {
      const auto at = watchers_.find(cube);
      return at != watchers_.end() && std::any_of(at->second.begin(), at->second.end(), [&](const Watcher& watcher) {
               return DistanceSq<D>(watcher.position, x) <= watcher.reach_sq;
             });
    }
    if ((faces & ~(3u << (2 * axis))) == 0) {
      return HasBeside(cube, axis + 1, x, faces);
    }
    const double middle = cube.second[axis];
    for (const double step : {0.0, -1.0, 1.0}) {
      cube.second[axis] = middle + step;
      if (HasBeside(cube, axis + 1, x, faces)) {
        return true;
      }
    }
    return false;
  }

  absl::flat_hash_map<Cube, std::vector<Watcher>> watchers_;  // where there are any
  absl::flat_hash_map<VertexId, Cube> cubes_;                 // of all
  std::map<int, uint32_t> levels_;                            // and how many are at each
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_FACE_WATCHERS_H_
