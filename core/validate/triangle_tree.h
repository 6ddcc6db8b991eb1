// Triangles in space, of which the nearest to a point is found: the validators' own search, which shares nothing with
// the index by which a mesher looks.
#ifndef WELLSPACE_CORE_VALIDATE_TRIANGLE_TREE_H_
#define WELLSPACE_CORE_VALIDATE_TRIANGLE_TREE_H_

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/point.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {

// A triangle, and the squared distance to it.
struct NearTriangle {
  uint32_t triangle = std::numeric_limits<uint32_t>::max();
  double distance_sq = std::numeric_limits<double>::infinity();

  bool IsNone() const { return triangle == std::numeric_limits<uint32_t>::max(); }
};

// Thread safety: thread-compatible; const functions may run at once.
class TriangleTree {
 public:
  // Complexity: O(n log n).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(std::vector<Triangle> triangles, const RunContext& context) {
    triangles_ = std::move(triangles);
    std::vector<Box<3>> boxes;
    boxes.reserve(triangles_.size());
    for (const Triangle& triangle : triangles_) {
      boxes.push_back(BoxOfTriangle(triangle));
    }
    return tree_.Build(std::move(boxes), context);
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }
  const BoxTree<3>& boxes() const { return tree_; }

  double DistanceSqTo(uint32_t triangle, const Point<3>& p) const {
    return DistanceSq<3>(p, NearestPoint(triangles_[triangle], p));
  }

  // The triangle nearest to `p` of those for which is_wanted(triangle) is true. `hint`: one that may be near.
  //
  // Complexity: O(log n + k) where the hint is near, k triangles that are as near.
  template <typename IsWanted>
  NearTriangle Nearest(const Point<3>& p, uint32_t hint, const IsWanted& is_wanted) const {
    NearTriangle best;
    const auto look = [&](uint32_t t) {
      if (is_wanted(t)) {
        if (const double distance_sq = DistanceSqTo(t, p); distance_sq < best.distance_sq || best.IsNone()) {
          best = {t, distance_sq};
        }
      }
    };
    if (hint < triangles_.size()) {
      look(hint);
    }
    tree_.ForEach([&](const Box<3>& box) { return DistanceSq<3>(p, box) < best.distance_sq; }, look);
    return best;
  }
  NearTriangle Nearest(const Point<3>& p, uint32_t hint) const {
    return Nearest(p, hint, [](uint32_t) { return true; });
  }

  // The memory of a tree over so many triangles. Unit: bytes.
  static uint64_t Bytes(uint64_t triangles) { return triangles * sizeof(Triangle) + BoxTree<3>::Bytes(triangles); }

 private:
  std::vector<Triangle> triangles_;
  BoxTree<3> tree_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_TRIANGLE_TREE_H_
