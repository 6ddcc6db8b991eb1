// A planar straight-line graph: the segments of a domain once they meet in common ends alone.
#ifndef WELLSPACE_CORE_FEATURES_PLANAR_GRAPH_H_
#define WELLSPACE_CORE_FEATURES_PLANAR_GRAPH_H_

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/features/odd_sets.h"
#include "core/features/point_merge.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A segment of a planar graph.
struct GraphSegment {
  static constexpr uint32_t kBoxSide = std::numeric_limits<uint32_t>::max() - 3;  // + FaceIndex

  uint32_t a = 0;  // points
  uint32_t b = 0;
  int32_t marker = 0;
  uint32_t source = 0;                  // the first given segment that it is a part of, or a side of the box
  uint32_t rings = 1;                   // the number of ring segments on it
  uint32_t polygons = OddSets::kEmpty;  // whose rings an odd number of times lie on it: a set of PlanarGraph::polygons
  uint32_t groups = OddSets::kEmpty;    // the same of groups: a set of PlanarGraph::groups

  bool IsBoxSide() const { return source >= kBoxSide; }
};

// The changes on the way from the given segments to a graph.
struct CleaningCounts {
  uint64_t equal_points = 0;        // beyond the first at each place
  uint64_t merged_points = 0;       // that have become one with other coordinates
  uint64_t empty_segments = 0;      // of no length
  uint64_t duplicate_segments = 0;  // beyond the first
  uint64_t touching_vertices = 0;   // that lay on a segment, which was split there
  uint64_t crossings = 0;           // of two segments, which were split there
  uint64_t near_vertices = 0;       // that lay too close to a segment, which was led through them
  uint64_t compared_pairs = 0;      // of features, to find all these
};

// Invariants: (1) points are distinct; (2) two segments have at most one point in common, and then an end of both; (3)
// a point on a segment is an end of it; (4) a point is at least the least separation from every segment that it is no
// end of, and at least the snap distance, if there is one, where both parts of the segment would be shorter than it.
struct PlanarGraph {
  std::vector<Point<2>> points;          // the given ones in the order of their first appearance, then others
  std::vector<uint32_t> point_of_input;  // by given point
  std::vector<uint32_t> input_of_point;  // the first given point there; kNoInput for those made here
  std::vector<GraphSegment> segments;    // by source, then along it from its lower end to its higher one
  CleaningCounts counts;
  OddSets polygons;  // of seeds
  OddSets groups;    // as GroupsOfSegments numbers them; of FaceRule::kUnion

  static constexpr uint32_t kNoInput = std::numeric_limits<uint32_t>::max();
};

// Makes a planar graph of the segments of `features` over `points`, n x 2; by exact signs alone, but for
// `least_separation`, the distance that has to be between a vertex and a segment that it is not on. Where segments are
// led through vertices, those nearer than features.snap_distance to one are too close to it, too. With `box` its
// corners and sides belong to the graph. `merge` says which points are one; none: as MergeTwins finds them.
//
// Guarantees: (1) where nothing crosses and nothing is too close, no coordinate is computed: a segment is split only at
//             points that lie on it exactly; (2) neither the order of segments nor that of points, nor which end comes
//             first, changes a place, or which segments there are.
// Complexity: O((n + m) log (n + m) + k) for most inputs with k faults. That is so, too, where all segments have a
//             common end, lie side by side or on a common line.
// Errors:     INVALID_ARGUMENT, naming segments, points and places: an end that does not exist; markers that differ on
//             one segment; seeds whose polygons are not there, or not closed; under kUnion groups whose rings are not
//             closed; and, unless they are to be split, segments that cross and vertices that are too close.
//             RESOURCE_EXHAUSTED when splitting does not end, or crossings make more than `max_vertices`.
//             CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores.
// Source:     docs/design/features.md.
absl::StatusOr<PlanarGraph> MakePlanarGraph(std::span<const double> points, const Features& features, const Box<2>* box,
                                            double least_separation, uint64_t max_vertices, int threads,
                                            const RunContext& context, std::optional<PointMerge> merge = std::nullopt);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_PLANAR_GRAPH_H_
