// The features that bound a domain, as they came, of one call or of a session: in the plane or in space.
#ifndef WELLSPACE_SERVER_INPUTS_FEATURE_STORE_H_
#define WELLSPACE_SERVER_INPUTS_FEATURE_STORE_H_

#include <algorithm>
#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "core/input/input.h"
#include "server/inputs/feature_summary.h"
#include "server/inputs/plane_features.h"
#include "server/inputs/space_features.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// Some features, as requests bring them and as they are written down.
using FeaturePart = store::v1::StepRecord::Features;

FeatureCounts CountsOf(const FeaturePart& part);

// The bytes of these, in memory and on the disk alike. Unit: bytes.
uint64_t FeatureBytes(const FeatureCounts& counts);

// Refuses features that bound no domain of `dimension`, chunks that have no whole rows, and rules that are not known.
// `first`: the numbers of the first of each kind.
//
// Errors:     INVALID_CHUNK_SHAPE, INVALID_SEGMENTS, INVALID_TRIANGLES.
absl::Status CheckFeatures(const FeaturePart& part, const FeatureCounts& first, int dimension);

// Takes the first `known` of each kind out of `part`, whose rules stay.
//
// REQUIRES:   known is at most the counts that it has.
void DropKnown(const FeatureCounts& known, FeaturePart& part);

// Writes it down in `record`.
void SetFeatures(const FeatureSummary& summary, store::v1::SessionRecord& record);

// Features that grow at the end.
//
// Thread safety: thread-compatible.
// Invariants: appended features have passed CheckFeatures, always with the same dimension.
class FeatureStore {
 public:
  // Appends the rows of `part` but for the first `known` of each kind. After an exception, when memory ends, some of it
  // may be there: TakeBack.
  //
  // REQUIRES:   known is at most the counts that it has.
  void Append(const FeaturePart& part, const FeatureCounts& known = {});
  // Takes out again all that was appended since Summary() was `before`.
  void TakeBack(const FeatureSummary& before);

  // How many of the first `count` of each kind in `part` are those from number `first` on: all of these, or those
  // before the first that is another.
  //
  // REQUIRES:   first + count is at most counts().
  FeatureCounts CountEqual(const FeatureCounts& first, const FeatureCounts& count, const FeaturePart& part) const;
  // Whether Append(part) would change the rules, or make this other than empty by rules alone.
  bool HasOtherRules(const FeaturePart& part) const;

  // Whether there are neither features nor rules: the points are a cloud, and are meshed in their box.
  bool IsEmpty() const { return plane_.IsEmpty() && space_.IsEmpty(); }
  FeatureSummary Summary() const { return plane_.IsEmpty() ? space_.Summary() : plane_.Summary(); }
  FeatureCounts counts() const { return Summary().counts; }
  uint64_t bytes() const { return FeatureBytes(counts()); }

  // `points` and their features. Valid until the next Append.
  core::Input InputOf(std::span<const double> points) const;
  // The numbers of points that segments or triangles have.
  std::span<const uint32_t> points() const { return plane_.IsEmpty() ? space_.corners() : plane_.ends(); }

 private:
  PlaneFeatures plane_;
  SpaceFeatures space_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_FEATURE_STORE_H_
