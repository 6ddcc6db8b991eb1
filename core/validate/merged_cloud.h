// Whether a mesh has the points of a cloud of which near ones were merged: ValidateCloud asks it then.
#ifndef WELLSPACE_CORE_VALIDATE_MERGED_CLOUD_H_
#define WELLSPACE_CORE_VALIDATE_MERGED_CLOUD_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Vertices by the cubes of side `distance` that they lie in.
//
// Thread safety: thread-compatible.
template <int D>
class NearLookup {
 public:
  // REQUIRES:   0 < distance, finite.
  explicit NearLookup(double distance) : distance_(distance) {}

  void Add(const Point<D>& p) { cubes_[CubeOf(p)].push_back(p); }

  // Whether a point that was added is within the distance, up to rounding.
  //
  // Complexity: O(3^D), and O(1) for each point in the cubes around `p`.
  bool HasNear(const Point<D>& p) const {
    const Cube own = CubeOf(p);
    Cube cube = own;
    return HasNearFrom(p, own, cube, 0);
  }

 private:
  using Cube = std::array<double, D>;  // of whole numbers, which may be past those of integers

  Cube CubeOf(const Point<D>& p) const {
    Cube cube;
    for (int i = 0; i < D; ++i) {
      cube[i] = std::floor(p[i] / distance_);
    }
    return cube;
  }

  bool HasNearFrom(const Point<D>& p, const Cube& own, Cube& cube, int axis) const {
    if (axis < D) {
      for (const double step : {0.0, -1.0, 1.0}) {
        cube[axis] = own[axis] + step;
        if (HasNearFrom(p, own, cube, axis + 1)) {
          return true;
        }
      }
      return false;
    }
    constexpr double kRounding = 1 + 1e-9;
    const auto found = cubes_.find(cube);
    if (found == cubes_.end()) {
      return false;
    }
    for (const Point<D>& q : found->second) {
      double distance = 0;
      for (int i = 0; i < D; ++i) {
        distance = std::hypot(distance, q[i] - p[i]);
      }
      if (distance <= distance_ * kRounding) {
        return true;
      }
    }
    return false;
  }

  const double distance_;
  absl::flat_hash_map<Cube, std::vector<Point<D>>> cubes_;
};

// The first of `cloud`, n x D, that the mesh does not have, if there is one. A point is there if it is the next of the
// vertices `points`, to the bit, or if it is no farther than `distance` from a vertex that a point of the cloud is.
//
// Shapes:     cloud and points: row-major.
// REQUIRES:   0 < distance, finite.
// Complexity: O(n) expected, if few points of the cloud that are vertices are that near to each other.
// Errors:     none.
template <int D>
std::optional<size_t> FirstMissingOfMerged(std::span<const double> cloud, std::span<const double> points,
                                           double distance) {
  const auto point = [](std::span<const double> rows, size_t i) {
    Point<D> p;
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(i * D), D, p.begin());
    return p;
  };
  NearLookup<D> kept(distance);
  std::vector<size_t> merged;
  size_t vertex = 0;
  for (size_t i = 0; i < cloud.size() / D; ++i) {
    const Point<D> p = point(cloud, i);
    const bool is_next =
        vertex < points.size() / D && std::ranges::equal(p, point(points, vertex), [](double a, double b) {
          return a == b && std::signbit(a) == std::signbit(b);
        });
    if (is_next) {
      kept.Add(p);
      ++vertex;
    } else {
      merged.push_back(i);
    }
  }
  for (const size_t i : merged) {
    if (!kept.HasNear(point(cloud, i))) {
      return i;
    }
  }
  return std::nullopt;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_MERGED_CLOUD_H_
