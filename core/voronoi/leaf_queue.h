// Leaves that a scan has met and not yet opened, the near ones first. QueryStructure begins one for each query.
#ifndef WELLSPACE_CORE_VORONOI_LEAF_QUEUE_H_
#define WELLSPACE_CORE_VORONOI_LEAF_QUEUE_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "core/base/ids.h"
#include "core/base/simd/lanes.h"

namespace wellspace::core {

// A leaf is queued in a class with those whose distances round to the same power of two: first come, first served
// there. As many leaves are opened then as in the order of the distances themselves, and none has to be looked for.
//
// Thread safety: thread-compatible. For one scan; made where it is used, so that its counters stay in
//                registers.
class LeafQueue {
 public:
  struct Entry {
    double distance_sq;  // from the site
    NodeId leaf;
    uint32_t next;  // of the class, among entries_
  };
  // One entry for each class, before its first, and all leaves of a scan. Reused from scan to scan: no allocation once
  // warm.
  using Memory = std::vector<Entry>;

  // For a scan from a leaf of side `scale`: far nearer distances are one class, and far farther ones.
  WELLSPACE_INLINE LeafQueue(Memory& memory, double scale)
      : memory_(memory), base_(Class(scale * scale) - kNearClasses), last_(kFirstOfClasses) {}
  WELLSPACE_INLINE bool IsEmpty() const { return occupied_ == 0; }

  // Makes room for `more` leaves.
  WELLSPACE_INLINE void Reserve(size_t more) {
    if (end_ + more > room_) {
      entries_ = Grow(memory_, end_ + more);
      room_ = memory_.size();
    }
  }

  // Adds a leaf if it `counts`.
  //
  // REQUIRES:   room for it; distance_sq >= 0.
  // Complexity: O(1), without a branch, since it could not be predicted.
  WELLSPACE_INLINE void PushIf(bool counts, double distance_sq, NodeId leaf) {
    const auto at = static_cast<size_t>(std::clamp<int64_t>(Class(distance_sq) - base_, 0, kClasses - 1));
    const uint32_t one = counts ? 1 : 0;
    const uint32_t last = last_[at];
    entries_[end_] = {distance_sq, leaf, 0};
    entries_[last].next = end_;
    last_[at] = last ^ ((last ^ end_) & -one);
    occupied_ |= one << at;
    end_ += one;
  }

  // Takes the first of the nearest class.
  //
  // REQUIRES:   not empty.
  // Complexity: O(1).
  WELLSPACE_INLINE Entry Pop() {
    const auto at = static_cast<uint32_t>(std::countr_zero(occupied_));
    const uint32_t first = entries_[at].next;
    const uint32_t last = last_[at];
    const uint32_t was_last = last == first ? 1 : 0;
    entries_[at].next = entries_[first].next;
    last_[at] = last ^ ((last ^ at) & -was_last);
    occupied_ ^= was_last << at;
    return entries_[first];
  }

 private:
  static constexpr uint32_t kClasses = 16;
  static constexpr int64_t kNearClasses = 4;
  static constexpr std::array<uint32_t, kClasses> kFirstOfClasses = [] {
    std::array<uint32_t, kClasses> firsts{};
    std::iota(firsts.begin(), firsts.end(), 0u);
    return firsts;
  }();

  // Two powers of two of the square, by its exponent.
  WELLSPACE_INLINE static int64_t Class(double distance_sq) { return std::bit_cast<int64_t>(distance_sq) >> 53; }

  [[gnu::noinline]] static Entry* Grow(Memory& memory, size_t least) {
    memory.resize(2 * least);
    return memory.data();
  }

  Memory& memory_;
  Entry* entries_ = memory_.data();
  size_t room_ = memory_.size();
  const int64_t base_;
  uint32_t occupied_ = 0;                // by class, a bit for whether any leaf is queued
  uint32_t end_ = kClasses;              // of the entries
  std::array<uint32_t, kClasses> last_;  // by class, in entries_
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_LEAF_QUEUE_H_
