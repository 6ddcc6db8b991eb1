// Sides of a domain in the plane that match: which segment on the one is which on the other.
#ifndef WELLSPACE_CORE_FEATURES_PERIODIC_SIDES_H_
#define WELLSPACE_CORE_FEATURES_PERIODIC_SIDES_H_

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/planar_graph.h"
#include "core/geometry/periodic_box.h"

namespace wellspace::core {

// The sides of the bounding box of a domain across its periodic axes. Each segment on such a side has an image on the
// opposite side: the segment between the images of its ends.
//
// Thread safety: thread-compatible.
class PeriodicSides {
 public:
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  // None of the axes is periodic.
  PeriodicSides() = default;

  // Pairs the segments of `graph`, all of which bound the domain or lie inside of it. Other points on a side, as ends
  // of segments that only touch it, have images, too.
  //
  // REQUIRES:   axes are 0, 1 or both; there is a segment.
  // Memory:     5 bytes for each segment, and 12 for each point on a side meanwhile.
  // Complexity: O(n + m + k log k) with k points on the sides.
  // Errors:     INVALID_ARGUMENT, naming the side, and the first point or segment without an image with the place where
  //             it is expected; a side without segments. CANCELLED, DEADLINE_EXCEEDED.
  static absl::StatusOr<PeriodicSides> Find(const PlanarGraph& graph, std::span<const int> axes,
                                            const RunContext& context);

  bool HasAxes() const { return !images_.empty(); }
  // The segment that is the image of `segment`; kNone if that is on none of the sides.
  uint32_t ImageOf(uint32_t segment) const { return images_.empty() ? kNone : images_[segment]; }
  // Whether end a of `segment` has end b of the image as its own. REQUIRES: it has an image.
  bool IsTurned(uint32_t segment) const { return is_turned_[segment]; }
  // Where the images of points are, in the coordinates of the graph.
  const PeriodicBox<2>& box() const { return box_; }

  uint64_t MemoryBytes() const { return BytesFor(images_.size()); }
  static uint64_t BytesFor(uint64_t segments) { return segments * sizeof(uint32_t) + segments / 8; }

 private:
  std::vector<uint32_t> images_;  // by segment; empty: no axis is periodic
  std::vector<bool> is_turned_;   // by segment
  PeriodicBox<2> box_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_PERIODIC_SIDES_H_
