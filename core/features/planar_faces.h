// The faces of a planar graph: which face is on which side of a segment, and which of them are meshed.
#ifndef WELLSPACE_CORE_FEATURES_PLANAR_FACES_H_
#define WELLSPACE_CORE_FEATURES_PLANAR_FACES_H_

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/features/planar_graph.h"

namespace wellspace::core {

// A face of a planar graph. Number 0 is the unbounded one.
struct Face {
  bool is_meshed = false;
  int32_t region = 0;
  double max_area = std::numeric_limits<double>::infinity();  // of a triangle; a squared length
};

// A segment seen from one of its ends: segment << 1 | (0: from a to b, 1: from b to a).
using HalfEdge = uint32_t;
constexpr HalfEdge HalfEdgeOf(uint32_t segment, bool from_b) { return segment << 1 | (from_b ? 1 : 0); }
constexpr uint32_t SegmentOf(HalfEdge half_edge) { return half_edge >> 1; }
constexpr bool IsFromB(HalfEdge half_edge) { return (half_edge & 1) != 0; }
constexpr HalfEdge TwinOf(HalfEdge half_edge) { return half_edge ^ 1; }

// Invariants: (1) both sides of every segment have a face, for good, since nothing crosses a segment.
struct PlanarFaces {
  std::vector<Face> faces;
  std::vector<uint32_t> left_face;  // by half-edge
  // Seeds that are points and mean nothing: the rule does not mesh the face that they lie in. How many, and the first.
  uint64_t unused_seeds = 0;
  uint32_t first_unused_seed = 0;
  std::vector<uint32_t> point_face;  // by point: where it lies if it is an end of no segment, else kOnSegments
  // The half-edges that leave point p, counterclockwise: around[first_around[p]] to around[first_around[p + 1]].
  std::vector<uint32_t> first_around;
  std::vector<HalfEdge> around;

  static constexpr uint32_t kOnSegments = std::numeric_limits<uint32_t>::max();

  std::span<const HalfEdge> Around(uint32_t point) const {
    return {around.data() + first_around[point], first_around[point + 1] - first_around[point]};
  }
  bool IsMeshed(uint32_t face) const { return faces[face].is_meshed; }
};

// Finds the faces of `graph`, and which of them `rule` and `seeds` have meshed.
//
// Complexity: O((n + m) log (n + m)); under kUnion also the sum over all segments of the groups that they are of.
// Errors:     INVALID_ARGUMENT: a seed that is not finite, lies on a segment, or names a face for which another seed
//             says otherwise; for kEvenOdd, rings that are not closed; where nothing is to be meshed. CANCELLED,
//             DEADLINE_EXCEEDED.
// Source:     docs/design/features.md; a sweep along the first axis, ties by the second.
absl::StatusOr<PlanarFaces> FindFaces(const PlanarGraph& graph, FaceRule rule, std::span<const FaceSeed> seeds,
                                      const RunContext& context);

// Leaves out the segments that have no face to be meshed on either side, and the points that touch none; gives the
// other points the numbers that are given: permutation[i] is the number of the i-th point that stays. Segments are put
// in the order of their ends.
//
// Complexity: O((n + m) log m).
// Errors:     CANCELLED, DEADLINE_EXCEEDED; graph and faces are then as before.
absl::Status KeepMeshed(std::span<const uint32_t> permutation, PlanarGraph& graph, PlanarFaces& faces,
                        const RunContext& context);
// Whether each point stays.
std::vector<bool> FindMeshedPoints(const PlanarGraph& graph, const PlanarFaces& faces);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_PLANAR_FACES_H_
