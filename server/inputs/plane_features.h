// Segments and the faces that they bound, as they came, of one call or of a session.
#ifndef WELLSPACE_SERVER_INPUTS_PLANE_FEATURES_H_
#define WELLSPACE_SERVER_INPUTS_PLANE_FEATURES_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "core/features/features.h"
#include "server/base/growing_array.h"
#include "server/inputs/feature_rows.h"
#include "server/inputs/feature_summary.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// INVALID_SEGMENTS: `field` was sent for points of another dimension than 2.
absl::Status NotInThePlane(const char* field, int dimension);

// Refuses a chunk that is no list of segments. `first` is the number of its first segment.
//
// Errors:     INVALID_CHUNK_SHAPE.
absl::Status CheckSegments(const v1::SegmentChunk& chunk, uint64_t first);
// Refuses rules that are not known, and seeds that name no face. `first` is the number of the first seed.
//
// Errors:     INVALID_SEGMENTS.
absl::Status CheckFaces(const v1::FaceOptions& options, uint64_t first);

// Segments, seeds and rules that grow at the end.
//
// Thread safety: thread-compatible.
// Invariants: appended features have passed CheckSegments or CheckFaces.
class PlaneFeatures {
 public:
  // Appends the segments of `chunk` but for the first `known`. An exception, when memory ends, changes nothing.
  //
  // REQUIRES:   known is at most their number.
  void Append(const v1::SegmentChunk& chunk, uint64_t known = 0);
  // The same of seeds. The rules are from now on those of `options`.
  void Append(const v1::FaceOptions& options, uint64_t known = 0);

  // Takes out again all that was appended since Summary() was `before`.
  void TakeBack(const FeatureSummary& before);

  // How many of the segments of `chunk`, of the first `count` at most, are those from number `first` on: all of these,
  // or those before the first that is another.
  //
  // REQUIRES:   first + count <= segment_count().
  uint64_t CountEqual(uint64_t first, uint64_t count, const v1::SegmentChunk& chunk) const;
  // The same of seeds, whose coordinates are compared to the bit.
  uint64_t CountEqual(uint64_t first, uint64_t count, const v1::FaceOptions& options) const;
  // Whether Append(options) would change the rules, or make this other than empty.
  bool HasOtherRules(const v1::FaceOptions& options) const;

  // Whether there are neither segments nor rules: the points are a cloud, and are meshed in their box.
  bool IsEmpty() const { return segments_.count() == 0 && !has_rules_; }
  FeatureSummary Summary() const;
  uint64_t segment_count() const { return segments_.count(); }
  uint64_t seed_count() const { return seeds_.size(); }
  static constexpr uint64_t kSegmentBytes = FeatureRows<2>::kBytes + sizeof(uint32_t) + sizeof(uint8_t);
  static constexpr uint64_t kSeedBytes = sizeof(core::FaceSeed);

  // For core::Input. Valid until the next Append.
  core::Features View() const;
  std::span<const uint32_t> ends() const { return segments_.points(); }

 private:
  v1::FaceRule face_rule() const;
  v1::CrossingRule crossing_rule() const;

  bool has_rules_ = false;  // some have come
  FeatureRows<2> segments_;
  GrowingArray<uint8_t> is_open_;
  GrowingArray<uint32_t> groups_;
  GrowingArray<core::FaceSeed> seeds_;
  core::FaceRule faces_ = core::FaceRule::kBox;
  core::CrossingRule crossings_ = core::CrossingRule::kRefuse;
  double snap_distance_ = 0;
  core::PartNames names_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_PLANE_FEATURES_H_
