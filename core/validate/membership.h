// The side of triangles that a point is on, and the number of tetrahedra that hold it: by rays and exact signs.
#ifndef WELLSPACE_CORE_VALIDATE_MEMBERSHIP_H_
#define WELLSPACE_CORE_VALIDATE_MEMBERSHIP_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/validate/triangle_tree.h"
#include "core/validate/validate.h"

namespace wellspace::core {

// Where a ray from a point goes through triangles.
struct RayHits {
  uint64_t count = 0;
  uint32_t first = 0;          // triangle; where count is not 0
  bool first_in_front = true;  // whether its corners are counterclockwise seen from the point
};

// The triangles that a ray from `p` goes through, by exact signs. Where a ray meets an edge another one is taken; none
// if all few of them do, or `p` is on a triangle.
//
// Complexity: O(sqrt(n) + k) for most.
std::optional<RayHits> ShootRay(const Point<3>& p, const TriangleTree& triangles);

// Tetrahedra, of which those around a point are found.
//
// Thread safety: thread-compatible; const functions may run at once.
class TetrahedronTree {
 public:
  // REQUIRES:   `mesh` outlives it, in 3-D; ValidateIndices and ValidateOrientation are OK.
  // Complexity: O(m log m).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(const MeshView& mesh, const RunContext& context);

  Simplex<3> At(uint32_t tetrahedron) const;

  // The tetrahedra that have `p` strictly inside, into `found`; false if it is on a face of one.
  bool Find(const Point<3>& p, std::vector<uint32_t>& found) const;

 private:
  MeshView mesh_;
  BoxTree<3> tree_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_MEMBERSHIP_H_
