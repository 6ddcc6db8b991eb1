// The error of a vertex that is too close to a segment, while a graph is made and once it is.
#ifndef WELLSPACE_CORE_FEATURES_NEAR_SEGMENT_H_
#define WELLSPACE_CORE_FEATURES_NEAR_SEGMENT_H_

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// "points[3] at (0.5, 1) is 1e-17 from segments[0] and not on it".
//
// Units:      p and distance: as in the input, not scaled.
std::string DescribeNearSegment(std::string_view vertex, const Point<2>& p, double distance, std::string_view segment);

// The error for vertices of which `described` tells, by DescribeNearSegment; `least` is the distance that is needed.
// Once the graph is made a vertex within `on_segment` of a segment is on it. Before, that is 0, and a segment may still
// be led through the vertex.
//
// Units:      least and on_segment: as in the input, not scaled.
// Errors:     INVALID_ARGUMENT always.
absl::Status NearSegmentError(std::string_view described, double least, double on_segment);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_NEAR_SEGMENT_H_
