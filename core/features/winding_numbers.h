// Winding numbers of triangles that need not bound anything: how often they go around a point.
#ifndef WELLSPACE_CORE_FEATURES_WINDING_NUMBERS_H_
#define WELLSPACE_CORE_FEATURES_WINDING_NUMBERS_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/features/surface_complex.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {

// The triangles of a complex in a tree, of which a branch that is far away counts as one dipole.
//
// The winding number of a point is the sum of the solid angles under which it sees the triangles, by 4 pi: 1 inside of
// a closed surface whose triangles go counterclockwise as seen from outside, and 0 outside of it. Across a triangle it
// changes by 1; near a hole, and where triangles are missing, it goes gradually from one to the other.
//
// Thread safety: thread-compatible; const functions may run at once.
// Source:        Barill, Dickson, Schmidt, Levin, Jacobson, Fast Winding Numbers for Soups and Clouds, 2018.
class WindingNumbers {
 public:
  // REQUIRES:   the complex outlives this.
  // Guarantees: (1) neither the order of triangles nor that of points changes a bit of what follows.
  // Complexity: O(m log m).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(const SurfaceComplex& complex, const RunContext& context);

  // The memory of the tree. Unit: bytes.
  static uint64_t Bytes(uint64_t triangles) { return triangles * (sizeof(uint32_t) + sizeof(Point<3>) + sizeof(Node)); }

  // The winding number of `p`: within about 0.05 of the sum, and within 0.005 where that is within 0.1 of 1/2 or -1/2.
  //
  // Complexity: O(log m) where the surface is one; O(m) at worst.
  double At(const Point<3>& p) const;

  // Where the segment from `a` to `b` meets triangles, as shares of the way, ascending, into `shares`; rounded.
  void FindCrossings(const Point<3>& a, const Point<3>& b, std::vector<double>& shares) const;

 private:
  static constexpr uint32_t kLeafCapacity = 8;
  // A branch counts as one dipole from so many of its radii away on: at first, and where that does not decide.
  static constexpr double kFar = 2.5;
  static constexpr double kFarther = 10;
  static constexpr double kUndecided = 0.15;

  struct Node {
    Box<3> box{};          // of its triangles
    Point<3> middle{};     // of their areas
    Point<3> normal{};     // the sum of their normals, as long as their areas
    double radius_sq = 0;  // of a ball around `middle` that holds them
    uint32_t begin = 0;    // in order_
    uint32_t end = 0;
    uint32_t second = 0;  // the second child; the first one follows; 0: a leaf
  };

  absl::Status BuildNode(uint32_t begin, uint32_t end, const RunContext& context);
  void Describe(Node& node) const;
  double SumAt(const Point<3>& p, double far) const;

  const SurfaceComplex* complex_ = nullptr;
  std::vector<Point<3>> middles_;  // of triangles, while the tree is built
  std::vector<uint32_t> order_;    // triangles, those of a node side by side
  std::vector<Node> nodes_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_WINDING_NUMBERS_H_
