// Receives the messages of one call of MeshPoints or EstimateMesh: parameters, then points, features, and
// sizes.
#ifndef WELLSPACE_SERVER_SERVICES_MESHING_CLOUD_RECEIVER_H_
#define WELLSPACE_SERVER_SERVICES_MESHING_CLOUD_RECEIVER_H_

#include <cstdint>
#include <utility>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/meshers/mesher.h"
#include "server/base/options.h"
#include "server/inputs/feature_store.h"
#include "server/inputs/number_chunks.h"
#include "server/inputs/size_store.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// Checks the order and the contents of the requests of one call and keeps the points. Fast enough for a reaction: no
// coordinate of a point is looked at or copied. Segments and triangles are copied, and sizes are looked at.
//
// Thread safety: thread-compatible.
// Invariants: never holds more than options.max_points points, segments, triangles, seeds or samples of
//             sizes.
class CloudReceiver {
 public:
  // REQUIRES:   `options` outlives this.
  explicit CloudReceiver(const ServiceOptions& options) : options_(options) {}

  // Takes over the contents of the next request.
  //
  // Errors:     EMPTY_REQUEST, PARAMETERS_MISSING, PARAMETERS_REPEATED, INVALID_PARAMETERS, INVALID_CHUNK_SHAPE,
  //             TOO_MANY_POINTS, INVALID_SEGMENTS, INVALID_TRIANGLES, INVALID_SIZES; the call is to be ended.
  template <typename Request>
  absl::Status Accept(Request* request);

  // To be called when the client has ended its stream, and before FlattenSizes.
  //
  // Errors:     PARAMETERS_MISSING; INVALID_PARAMETERS, of those that such a domain does not have.
  absl::Status AcceptEnd();

  bool has_parameters() const { return has_parameters_; }
  const core::MeshParameters& parameters() const { return parameters_; }
  uint64_t point_count() const { return point_count_; }
  // Of all that it holds.
  uint64_t held_bytes() const { return points_.bytes() + features_.bytes() + sizes_.bytes(); }
  uint64_t size_count() const { return sizes_.count(); }
  // Constant once the client has ended its stream.
  const FeatureStore& features() const { return features_; }

  // Hands over the points.
  NumberChunks TakePoints() { return std::exchange(points_, NumberChunks()); }
  // From then on parameters() has the sizes at points, unless the run is cancelled. To be called once.
  //
  // Complexity: O(sizes): they are copied, so not for a reaction where they are many.
  void FlattenSizes(const core::RunContext& context) { parameters_.size_samples = sizes_.Take(context); }

 private:
  absl::Status AcceptParameters(const v1::MeshParameters& message);
  absl::Status AcceptPoints(v1::PointChunk* chunk);
  // `field` is its field in the request.
  absl::Status AcceptFeatures(const FeaturePart& part, const char* field);
  absl::Status AcceptSizes(v1::SizeSamples* chunk);
  // Checks that this may hold `count` of `what`.
  absl::Status CheckCount(uint64_t count, const char* what) const;

  const ServiceOptions& options_;
  bool has_parameters_ = false;
  core::MeshParameters parameters_;
  uint64_t point_count_ = 0;
  NumberChunks points_;
  FeatureStore features_;
  SizeStore sizes_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_MESHING_CLOUD_RECEIVER_H_
