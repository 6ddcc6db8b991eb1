// Orders of few items by distance, without branches that the data decide: half of those would be mispredicted.
#ifndef WELLSPACE_CORE_VORONOI_NEARNESS_H_
#define WELLSPACE_CORE_VORONOI_NEARNESS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/ids.h"
#include "core/voronoi/lanes.h"

namespace wellspace::core {

// Writes to `order` the numbers of the `count` distances, the smallest first, of equal ones by number.
//
// REQUIRES:   distances aligned to kLanes doubles and padded: those beyond `count` may be read and overwritten.
// Complexity: O(count^2) up to 64, in vectors; else O(count log count).
// Errors:     none.
// Source:     rank sort.
void OrderByDistance(double* distances, size_t count, uint32_t* order, VectorUnit unit = BestVectorUnit());

// Leaves waiting to be opened, in no order.
//
// Thread safety: thread-compatible.
class LeafQueue {
 public:
  explicit LeafQueue(VectorUnit unit = BestVectorUnit()) : unit_(unit) {}

  void Clear() { count_ = 0; }
  bool IsEmpty() const { return count_ == 0; }
  void Push(double distance_sq, NodeId leaf) {
    if (count_ == leaves_.size()) {
      Grow();
    }
    groups_[count_ / kLanes].distance_sq[count_ % kLanes] = distance_sq;
    leaves_[count_++] = leaf;
  }

  struct Entry {
    double distance_sq;
    NodeId leaf;
  };
  // Takes the nearest; of those as near, that of the lowest number.
  //
  // REQUIRES:   not empty.
  // Complexity: O(waiting), in vectors: a few dozen wait.
  // Errors:     none.
  Entry Pop();

 private:
  struct alignas(kLanes * sizeof(double)) Group {
    double distance_sq[kLanes];
  };
  void Grow();

  VectorUnit unit_;
  size_t count_ = 0;
  std::vector<Group> groups_;
  std::vector<NodeId> leaves_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_NEARNESS_H_
