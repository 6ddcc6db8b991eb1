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
  size_t size() const { return count_; }
  NodeId leaf(size_t i) const { return leaves_[i]; }

  // Makes room for so many more.
  void Reserve(size_t more) {
    if (count_ + more > leaves_.size()) {
      Grow(more);
    }
  }
  // Appends a leaf if it `counts`.
  //
  // REQUIRES:   room for it.
  void PushIf(bool counts, double distance_sq, NodeId leaf) {
    groups_[count_ / kLanes].distance_sq[count_ % kLanes] = distance_sq;
    leaves_[count_] = leaf;
    count_ += counts ? 1 : 0;
  }

  struct Entry {
    double distance_sq;
    NodeId leaf;
  };
  // Takes the nearest; of those as near, any.
  //
  // REQUIRES:   not empty.
  // Complexity: O(waiting), in vectors: a few dozen wait.
  // Errors:     none.
  Entry Pop();

 private:
  struct alignas(kLanes * sizeof(double)) Group {
    double distance_sq[kLanes];
  };
  void Grow(size_t more);

  VectorUnit unit_;
  size_t count_ = 0;
  std::vector<Group> groups_;
  std::vector<NodeId> leaves_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_NEARNESS_H_
