#include "client/grpc/feature_messages.h"

#include <algorithm>

namespace wellspace::client {
namespace {

// Segments and seeds of one message: about 256 KiB.
constexpr size_t kSegmentsOfARequest = 16'384;
constexpr size_t kSeedsOfARequest = 4'096;

v1::FaceRule RuleToProto(FaceRule rule) {
  return rule == FaceRule::kHoles     ? v1::FACE_RULE_HOLES
         : rule == FaceRule::kEvenOdd ? v1::FACE_RULE_EVEN_ODD
         : rule == FaceRule::kUnion   ? v1::FACE_RULE_UNION
                                      : v1::FACE_RULE_BOX;
}

}  // namespace

size_t FillSegments(const Features& features, size_t first, v1::SegmentChunk& chunk) {
  const auto is_open = [&](size_t s) { return s < features.is_open.size() && features.is_open[s] != 0; };
  const size_t end = std::min(first + kSegmentsOfARequest, features.ends.size() / 2);
  chunk.Clear();
  chunk.set_open(is_open(first));
  for (; first < end && is_open(first) == chunk.open(); ++first) {
    chunk.add_ends(features.ends[2 * first]);
    chunk.add_ends(features.ends[2 * first + 1]);
    if (!features.markers.empty()) {
      chunk.add_markers(features.markers[first]);
    }
    if (!features.groups.empty()) {
      chunk.add_groups(features.groups[first]);
    }
  }
  return first;
}

size_t FillFaces(const Features& features, size_t first, v1::FaceOptions& options) {
  const size_t end = std::min(first + kSeedsOfARequest, features.seeds.size());
  options.Clear();
  options.set_faces(RuleToProto(features.faces));
  options.set_crossings(features.crossings == CrossingRule::kSplit  ? v1::CROSSING_RULE_SPLIT
                        : features.crossings == CrossingRule::kSnap ? v1::CROSSING_RULE_SNAP
                                                                    : v1::CROSSING_RULE_REFUSE);
  if (features.snap_distance.has_value()) {
    options.set_snap_distance(*features.snap_distance);
  }
  for (; first < end; ++first) {
    const FaceSeed& seed = features.seeds[first];
    v1::FaceSeed& message = *options.add_seeds();
    message.set_x(seed.x);
    message.set_y(seed.y);
    message.set_hole(seed.is_hole);
    message.set_region(seed.region);
    if (seed.max_area.has_value()) {
      message.set_max_area(*seed.max_area);
    }
    if (seed.segment_count > 0) {
      message.mutable_polygon()->set_first(seed.first_segment);
      message.mutable_polygon()->set_count(seed.segment_count);
    }
  }
  return end;
}

}  // namespace wellspace::client
