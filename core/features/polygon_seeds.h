// Seeds that are polygons: whether their rings are rings, and which faces lie in them.
#ifndef WELLSPACE_CORE_FEATURES_POLYGON_SEEDS_H_
#define WELLSPACE_CORE_FEATURES_POLYGON_SEEDS_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/features/odd_sets.h"
#include "core/features/planar_faces.h"
#include "core/features/planar_graph.h"

namespace wellspace::core {

// The seed whose polygon each segment is of, or OddSets::kEmpty; empty if no seed has a polygon.
//
// Complexity: O(m + s log s).
// Errors:     INVALID_ARGUMENT, naming seeds and segments: a segment that is not there, or is of two polygons.
//             CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<uint32_t>> PolygonsOfSegments(const Features& features, const RunContext& context);

// Whether the rings of all polygons are closed: at each point an even number of segments of a polygon ends. Points that
// are equal have one number in `point_of_input`.
//
// REQUIRES:   PolygonsOfSegments is OK, and so are all ends.
// Complexity: O(m log m).
// Errors:     INVALID_ARGUMENT, naming seed, segment and point. CANCELLED, DEADLINE_EXCEEDED.
absl::Status CheckPolygonsClosed(std::span<const uint32_t> point_of_input, const Features& features,
                                 const RunContext& context);

// For each face of `faces` the seed whose polygon has it: of those that hold it the one of least area; or
// OddSets::kEmpty. It does not depend on the order of segments and seeds.
//
// REQUIRES:   left_face is known of both sides of every segment, and the rings of polygons are closed.
// Complexity: O((f + k) log k), k the sum over all segments of the polygons that they bound.
// Errors:     INVALID_ARGUMENT, naming two seeds whose polygons have one area, hold a face, and say different things of
//             it. CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<uint32_t>> FindPolygonsOfFaces(const PlanarGraph& graph, const PlanarFaces& faces,
                                                          std::span<const FaceSeed> seeds, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_POLYGON_SEEDS_H_
