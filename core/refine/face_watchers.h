// Nodes on faces of the box that vertices there watch, to be looked at again once a new vertex cuts one off.
// PendingVertices keeps them, beside the memo of the edge of a face.
#ifndef WELLSPACE_CORE_REFINE_FACE_WATCHERS_H_
#define WELLSPACE_CORE_REFINE_FACE_WATCHERS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A node of a cell, which lies on faces of the box that its vertex is on, too. A vertex that is added on one of these,
// no farther from the node than `radius`, cuts it off.
template <int D>
struct WatchedNode {
  Point<D> centre;  // on its faces to the bit
  double radius = 0;
  FaceMask faces = 0;
};

// Nodes are hashed by cubes: each node by the cubes that its ball meets of the grid whose sides are more than twice and
// at most four times the radius, a power of two.
//
// Thread safety: thread-compatible.
template <int D>
class FaceWatchers {
 public:
  // Has `v` watch these nodes; all there are, known or not, if these are none.
  //
  // REQUIRES:   v is no watcher yet; radii above zero.
  // Complexity: O(2^D) for each node, O(2^(D - 1)) if it lies on one face; amortised.
  void Add(VertexId v, std::span<const WatchedNode<D>> nodes) {
    std::vector<uint32_t>& own = nodes_of_[v];
    watching_all_ += nodes.empty() ? 1 : 0;
    for (const WatchedNode<D>& node : nodes) {
      const uint32_t number = NewNumber();
      watched_[number] = {v, node};
      own.push_back(number);
      ++levels_[LevelOf(node)];
      ForEachCube(node, [&](const Cube& cube) { in_cubes_[cube].push_back(number); });
    }
  }

  // Removes `v` if it is a watcher.
  void Remove(VertexId v) {
    const auto own = nodes_of_.find(v);
    if (own == nodes_of_.end()) {
      return;
    }
    watching_all_ -= own->second.empty() ? 1 : 0;
    for (const uint32_t number : own->second) {
      const WatchedNode<D>& node = watched_[number].node;
      ForEachCube(node, [&](const Cube& cube) {
        const auto at = in_cubes_.find(cube);
        std::erase(at->second, number);
        if (at->second.empty()) {
          in_cubes_.erase(at);
        }
      });
      if (const auto at = levels_.find(LevelOf(node)); --at->second == 0) {
        levels_.erase(at);
      }
      free_.push_back(number);
    }
    nodes_of_.erase(own);
  }

  void Clear() { *this = {}; }

  // Whether some vertex watches all nodes.
  bool SomeWatchAll() const { return watching_all_ > 0; }

  // Calls f(VertexId) for each node that a vertex at `x` cuts off, which is on `faces`; not for vertices that watch
  // all.
  //
  // Complexity: O(1) for each power of two that radii have, and for each node near x.
  template <typename F>
  void ForEachCutOff(const Point<D>& x, FaceMask faces, F&& f) const {
    for (const auto& [level, count] : levels_) {
      const auto at = in_cubes_.find(CubeOf(x, level));
      if (at == in_cubes_.end()) {
        continue;
      }
      for (const uint32_t number : at->second) {
        const auto& [v, node] = watched_[number];
        if ((node.faces & faces) != 0 && DistanceSq<D>(node.centre, x) <= node.radius * node.radius) {
          f(v);
        }
      }
    }
  }

  uint64_t MemoryBytes() const {
    return in_cubes_.capacity() * sizeof(std::pair<Cube, std::vector<uint32_t>>) +
           nodes_of_.capacity() * sizeof(std::pair<VertexId, std::vector<uint32_t>>) +
           watched_.capacity() * (sizeof(Watched) + 4 * sizeof(uint32_t));
  }

 private:
  // The binary logarithm of the side, and the place in units of it.
  using Cube = std::pair<int, std::array<double, D>>;
  struct Watched {
    VertexId vertex;
    WatchedNode<D> node;
  };

  static int LevelOf(const WatchedNode<D>& node) { return std::ilogb(node.radius) + 2; }

  static double PlaceOf(double x, int level) { return std::floor(std::ldexp(x, -level)); }

  static Cube CubeOf(const Point<D>& p, int level) {
    Cube cube{level, {}};
    for (int i = 0; i < D; ++i) {
      cube.second[i] = PlaceOf(p[i], level);
    }
    return cube;
  }

  // Calls f(cube) for all cubes that hold a point which cuts off the node: if it lies on one face alone, that point is
  // as far along its axis.
  template <typename F>
  static void ForEachCube(const WatchedNode<D>& node, F&& f) {
    Cube cube{LevelOf(node), {}};
    const auto from_axis = [&](const auto& self, int axis) {
      if (axis == D) {
        f(cube);
        return;
      }
      const bool is_exact = (node.faces & ~(3u << (2 * axis))) == 0;
      const double reach = is_exact ? 0 : node.radius;
      // Two at most, if nothing is rounded.
      double last = std::numeric_limits<double>::quiet_NaN();
      for (const double x : {node.centre[axis] - reach, node.centre[axis], node.centre[axis] + reach}) {
        const double place = PlaceOf(x, cube.first);
        if (place != last) {
          cube.second[axis] = last = place;
          self(self, axis + 1);
        }
      }
    };
    from_axis(from_axis, 0);
  }

  uint32_t NewNumber() {
    if (free_.empty()) {
      watched_.emplace_back();
      return static_cast<uint32_t>(watched_.size() - 1);
    }
    const uint32_t number = free_.back();
    free_.pop_back();
    return number;
  }

  HugeVector<Watched> watched_;                                    // by number
  std::vector<uint32_t> free_;                                     // numbers
  absl::flat_hash_map<Cube, std::vector<uint32_t>> in_cubes_;      // numbers, where there are any
  absl::flat_hash_map<VertexId, std::vector<uint32_t>> nodes_of_;  // numbers, by watcher
  std::map<int, uint32_t> levels_;                                 // and how many nodes are at each
  uint32_t watching_all_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_FACE_WATCHERS_H_
