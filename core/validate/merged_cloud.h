// The check that a mesh has the points of a cloud of which near ones were merged, as part of ValidateCloud.
#ifndef WELLSPACE_CORE_VALIDATE_MERGED_CLOUD_H_
#define WELLSPACE_CORE_VALIDATE_MERGED_CLOUD_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
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

// The first of `cloud`, n x D, that the mesh does not have, if there is one. A point is there if it is one of the
// first of the vertices `points`, to the bit, or if it is no farther than `distance` from a vertex that a point of the
// cloud is. The first may be in any order: a vertex has its number by the first point that became it, which need not be
// the one that stayed.
//
// Shapes:     cloud and points: row-major.
// REQUIRES:   0 < distance, finite.
// Complexity: O(n + vertices) expected, if few points of the cloud that are vertices are that near to each other.
// Errors:     none.
template <int D>
std::optional<size_t> FirstMissingOfMerged(std::span<const double> cloud, std::span<const double> points,
                                           double distance) {
  const auto point = [](std::span<const double> rows, size_t i) {
    Point<D> p;
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(i * D), D, p.begin());
    return p;
  };
  const auto bits = [](const Point<D>& p) {
    std::array<uint64_t, D> of;
    std::ranges::transform(p, of.begin(), [](double x) { return std::bit_cast<uint64_t>(x); });
    return of;
  };
  absl::flat_hash_map<std::array<uint64_t, D>, size_t> vertices;
  vertices.reserve(points.size() / D);
  for (size_t v = 0; v < points.size() / D; ++v) {
    vertices.emplace(bits(point(points, v)), v);
  }
  NearLookup<D> kept(distance);
  std::vector<size_t> merged;
  std::vector<std::pair<size_t, size_t>> stayed;  // vertex and point
  for (size_t i = 0; i < cloud.size() / D; ++i) {
    const Point<D> p = point(cloud, i);
    if (const auto found = vertices.find(bits(p)); found == vertices.end()) {
      merged.push_back(i);
    } else {
      kept.Add(p);
      stayed.emplace_back(found->second, i);
    }
  }
  std::ranges::sort(stayed);
  for (size_t k = 0, first = 0; k < stayed.size(); ++k) {
    first += k > 0 && stayed[k].first != stayed[k - 1].first ? 1 : 0;
    if (stayed[k].first != first) {
      return stayed[k].second;  // it is a vertex that was added
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
