// Segments and faces as a client sends them, part by part.
#ifndef WELLSPACE_SERVER_SERVICES_MESHING_RECEIVED_FEATURES_H_
#define WELLSPACE_SERVER_SERVICES_MESHING_RECEIVED_FEATURES_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/features/features.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// Thread safety: thread-compatible.
// Invariants: never has more than `max_segments` segments, or seeds.
class ReceivedFeatures {
 public:
  explicit ReceivedFeatures(uint64_t max_segments) : max_segments_(max_segments) {}

  // Errors:     INVALID_CHUNK_SHAPE, TOO_MANY_POINTS; the call is to be ended.
  absl::Status Accept(const v1::SegmentChunk& chunk);
  // Errors:     INVALID_SEGMENTS (rules that are not known, areas), TOO_MANY_POINTS.
  absl::Status Accept(const v1::FaceOptions& options);

  // Whether nothing has come: the points are meshed in their box.
  bool IsEmpty() const { return !has_any_; }
  uint64_t bytes() const {
    return ends_.size() * sizeof(uint32_t) + markers_.size() * (sizeof(int32_t) + sizeof(uint8_t)) +
           seeds_.size() * sizeof(core::FaceSeed);
  }
  // Valid until the next Accept.
  core::Features View() const;

 private:
  const uint64_t max_segments_;
  bool has_any_ = false;
  std::vector<uint32_t> ends_;
  std::vector<int32_t> markers_;
  std::vector<uint8_t> is_open_;
  std::vector<core::FaceSeed> seeds_;
  core::FaceRule faces_ = core::FaceRule::kBox;
  core::CrossingRule crossings_ = core::CrossingRule::kRefuse;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_MESHING_RECEIVED_FEATURES_H_
