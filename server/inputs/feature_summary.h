// Numbers of features, and the rules by which they bound a domain.
#ifndef WELLSPACE_SERVER_INPUTS_FEATURE_SUMMARY_H_
#define WELLSPACE_SERVER_INPUTS_FEATURE_SUMMARY_H_

#include <cstdint>
#include <optional>

#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// Segments and seeds of faces in the plane, or triangles and seeds of solids in space.
struct FeatureCounts {
  uint64_t segments = 0;
  uint64_t triangles = 0;
  uint64_t seeds = 0;

  bool operator==(const FeatureCounts&) const = default;
  uint64_t all() const { return segments + triangles + seeds; }
  FeatureCounts operator+(const FeatureCounts& more) const {
    return {segments + more.segments, triangles + more.triangles, seeds + more.seeds};
  }
  // REQUIRES:   no more of any.
  FeatureCounts operator-(const FeatureCounts& less) const {
    return {segments - less.segments, triangles - less.triangles, seeds - less.seeds};
  }
};

// The summary of features without them.
struct FeatureSummary {
  FeatureCounts counts{};
  bool has_rules = false;  // some have come
  v1::FaceRule faces = v1::FACE_RULE_UNSPECIFIED;
  v1::CrossingRule crossings = v1::CROSSING_RULE_UNSPECIFIED;
  double snap_distance = 0;
  std::optional<v1::SurfaceOptions> surface{};  // without seeds, with defaults; nothing where there is no surface
  v1::PartNames names{};                        // of either

  // Whether a box bounds the domain: so it does where there are no features.
  bool AreInBox() const {
    return !surface.has_value() && (faces == v1::FACE_RULE_UNSPECIFIED || faces == v1::FACE_RULE_BOX);
  }
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_FEATURE_SUMMARY_H_
