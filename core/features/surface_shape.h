// The shape of a complex of triangles as a whole: where it is open or branches, which triangles go the other way, how
// sharp it is.
#ifndef WELLSPACE_CORE_FEATURES_SURFACE_SHAPE_H_
#define WELLSPACE_CORE_FEATURES_SURFACE_SHAPE_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_complex.h"

namespace wellspace::core {

// Open edges, those of one triangle, that follow each other until they come back.
struct OpenLoop {
  Point<3> at{};      // the middle of its bounding box
  double length = 0;  // of its edges
  uint32_t edges = 0;
  uint32_t first = 0;     // one of its edges, the lowest
  bool is_closed = true;  // false where it ends at an edge of three or more triangles
};

struct SurfaceShape {
  uint64_t components = 0;      // that have no point in common
  std::vector<OpenLoop> loops;  // the longest first; equal ones by their first edges
  uint64_t open_edges = 0;
  std::vector<uint32_t> odd_edges;  // of three, five, … triangles
  uint64_t branching_edges = 0;     // of three or more triangles
  // Triangles that would have to be turned, so that two at an edge go the same way; as few as will do. Edges of other
  // numbers of triangles separate the parts that are compared.
  uint64_t flipped_triangles = 0;
  uint32_t first_flipped = 0;  // triangle, if there is one
  uint64_t one_sided = 0;      // parts of which no turning makes that so, as of a Moebius strip
  double area = 0;
  // The smallest angle between triangles at an edge, seen from between them. Unit: degrees; 360 where no edge has two.
  double sharpest_angle = 360;
  uint32_t sharpest_edge = 0;
};

// Guarantees: (1) neither the order of triangles nor that of points changes a bit of the result.
// Complexity: O(m log m).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<SurfaceShape> DescribeShape(const SurfaceComplex& complex, const RunContext& context);

// The peak memory of DescribeShape. Unit: bytes.
uint64_t SurfaceShapeBytes(uint64_t points, uint64_t triangles);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SURFACE_SHAPE_H_
