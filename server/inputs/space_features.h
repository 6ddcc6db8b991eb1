// Triangles and the solids that they bound, as they came, of one call or of a session.
#ifndef WELLSPACE_SERVER_INPUTS_SPACE_FEATURES_H_
#define WELLSPACE_SERVER_INPUTS_SPACE_FEATURES_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "core/features/surface_features.h"
#include "server/base/growing_array.h"
#include "server/inputs/feature_rows.h"
#include "server/inputs/feature_summary.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// INVALID_TRIANGLES: `field` was sent for points of another dimension than 3.
absl::Status NotInSpace(const char* field, int dimension);

// Refuses a chunk that is no list of triangles. `first` is the number of its first triangle.
//
// Errors:     INVALID_CHUNK_SHAPE.
absl::Status CheckTriangles(const v1::TriangleChunk& chunk, uint64_t first);
// Refuses options that are not known or not in range, and seeds that name no solid. `first` is the number of the first
// seed.
//
// Errors:     INVALID_TRIANGLES.
absl::Status CheckSurface(const v1::SurfaceOptions& options, uint64_t first);

// Triangles, seeds and options that grow at the end.
//
// Thread safety: thread-compatible.
// Invariants: appended features have passed CheckTriangles or CheckSurface.
class SpaceFeatures {
 public:
  // Appends the triangles of `chunk` but for the first `known`. An exception, when memory ends, changes nothing.
  //
  // REQUIRES:   known is at most their number.
  void Append(const v1::TriangleChunk& chunk, uint64_t known = 0);
  // The same of seeds. All else is from now on that of `options`.
  void Append(const v1::SurfaceOptions& options, uint64_t known = 0);

  // Takes out again all that was appended since Summary() was `before`.
  void TakeBack(const FeatureSummary& before);

  // How many of the triangles of `chunk`, of the first `count` at most, are those from number `first` on: all of these,
  // or those before the first that is another.
  //
  // REQUIRES:   first + count <= triangle_count().
  uint64_t CountEqual(uint64_t first, uint64_t count, const v1::TriangleChunk& chunk) const;
  // The same of seeds, whose coordinates are compared to the bit.
  uint64_t CountEqual(uint64_t first, uint64_t count, const v1::SurfaceOptions& options) const;
  // Whether Append(options) would change anything but seeds, or make this other than empty.
  bool HasOtherRules(const v1::SurfaceOptions& options) const;

  // Whether there are neither triangles nor options: the points are a cloud, and are meshed in their box.
  bool IsEmpty() const { return triangles_.count() == 0 && !has_rules_; }
  FeatureSummary Summary() const;
  uint64_t triangle_count() const { return triangles_.count(); }
  uint64_t seed_count() const { return seeds_.size(); }
  static constexpr uint64_t kTriangleBytes = FeatureRows<3>::kBytes;
  static constexpr uint64_t kSeedBytes = sizeof(core::SolidSeed);

  // For core::Input. Valid until the next Append.
  core::SurfaceFeatures View() const;
  std::span<const uint32_t> corners() const { return triangles_.points(); }

 private:
  bool has_rules_ = false;  // options have come
  FeatureRows<3> triangles_;
  GrowingArray<core::SolidSeed> seeds_;
  core::SurfaceFeatures rules_;  // without the arrays above
  core::PartNames names_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_SPACE_FEATURES_H_
