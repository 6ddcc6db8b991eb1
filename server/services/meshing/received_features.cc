#include "server/services/meshing/received_features.h"

#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

bool RuleFromProto(v1::FaceRule rule, core::FaceRule* out) {
  switch (rule) {
    case v1::FACE_RULE_UNSPECIFIED:
    case v1::FACE_RULE_BOX:
      *out = core::FaceRule::kBox;
      return true;
    case v1::FACE_RULE_HOLES:
      *out = core::FaceRule::kHoles;
      return true;
    case v1::FACE_RULE_EVEN_ODD:
      *out = core::FaceRule::kEvenOdd;
      return true;
    default:
      return false;
  }
}

}  // namespace

absl::Status ReceivedFeatures::Accept(const v1::SegmentChunk& chunk) {
  const uint64_t before = ends_.size() / 2;
  if (chunk.ends_size() % 2 != 0) {
    return MakeError(
        v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
        absl::StrCat("the chunk after segment ", before, " has ", chunk.ends_size(), " ends; expected a multiple of 2"),
        "segments.ends");
  }
  const int count = chunk.ends_size() / 2;
  if (chunk.markers_size() != 0 && chunk.markers_size() != count) {
    return MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                     absl::StrCat("the chunk after segment ", before, " has ", chunk.markers_size(), " markers and ",
                                  count, " segments; expected one for each, or none"),
                     "segments.markers");
  }
  if (before + count > max_segments_) {
    return MakeError(
        v1::ERROR_REASON_TOO_MANY_POINTS,
        absl::StrCat("at least ", before + count, " segments; this server accepts at most ", max_segments_));
  }
  has_any_ = true;
  ends_.insert(ends_.end(), chunk.ends().begin(), chunk.ends().end());
  markers_.insert(markers_.end(), chunk.markers().begin(), chunk.markers().end());
  markers_.resize(before + count, 0);
  is_open_.resize(before + count, chunk.open() ? 1 : 0);
  return absl::OkStatus();
}

absl::Status ReceivedFeatures::Accept(const v1::FaceOptions& options) {
  if (!RuleFromProto(options.faces(), &faces_)) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("faces: ", static_cast<int>(options.faces()),
                                  " is not known; 1 (box), 2 (holes) and 3 (even-odd) are, and 0 for the default"),
                     "faces.faces");
  }
  if (options.crossings() < v1::CROSSING_RULE_UNSPECIFIED || options.crossings() > v1::CROSSING_RULE_SPLIT) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("crossings: ", static_cast<int>(options.crossings()),
                                  " is not known; 1 (refuse) and 2 (split) are, and 0 for the default"),
                     "faces.crossings");
  }
  crossings_ =
      options.crossings() == v1::CROSSING_RULE_SPLIT ? core::CrossingRule::kSplit : core::CrossingRule::kRefuse;
  if (seeds_.size() + options.seeds_size() > max_segments_) {
    return MakeError(v1::ERROR_REASON_TOO_MANY_POINTS,
                     absl::StrCat("more than ", max_segments_, " seeds, which is what this server accepts"));
  }
  for (const v1::FaceSeed& seed : options.seeds()) {
    if (!(seed.max_area() >= 0) || !std::isfinite(seed.max_area())) {
      return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                       absl::StrCat("seeds[", seeds_.size(), "]: max_area ", seed.max_area(),
                                    " is not a finite number of at least 0"),
                       "faces.seeds");
    }
    seeds_.push_back({.at = {seed.x(), seed.y()},
                      .is_hole = seed.hole(),
                      .region = seed.region(),
                      .max_area = seed.max_area() > 0 ? seed.max_area() : std::numeric_limits<double>::infinity()});
  }
  has_any_ = true;
  return absl::OkStatus();
}

core::Features ReceivedFeatures::View() const {
  return {.ends = ends_,
          .markers = markers_,
          .is_open = is_open_,
          .seeds = seeds_,
          .faces = faces_,
          .crossings = crossings_};
}

}  // namespace wellspace::server
