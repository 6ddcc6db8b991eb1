// The schedule S of [HT08] Figure 4: vertices in buckets by the length of their next short edge, the shortest first.
#ifndef WELLSPACE_CORE_REFINE_SCHEDULE_H_
#define WELLSPACE_CORE_REFINE_SCHEDULE_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/ids.h"

namespace wellspace::core {

// Buckets are one power of two of the squared length wide, the square root of 2 in length. (The paper has 2: finer
// buckets make smaller meshes for more work.) Powers of two need no logarithm, so that all machines sort alike.
//
// Thread safety: thread-compatible.
// Invariants: (1) a vertex waits in one bucket at most; (2) Pop takes from the lowest bucket that is not empty, the
// last come first.
class Schedule {
 public:
  // Lengths below `shortest` fall into the lowest bucket.
  explicit Schedule(double shortest) : first_exponent_(std::ilogb(shortest * shortest)) {}

  // REQUIRES:   length_sq is a finite number above zero.
  int BucketOf(double length_sq) const { return std::max(0, std::ilogb(length_sq) - first_exponent_); }
  // The squared length at which `bucket` ends.
  double UpperLengthSq(int bucket) const { return std::ldexp(1.0, first_exponent_ + bucket + 1); }

  // Puts `v` in the bucket of a length, unless it waits in that one or a lower one already.
  void Add(VertexId v, double length_sq) { AddToBucket(v, BucketOf(length_sq)); }

  void AddToBucket(VertexId v, int bucket) {
    if (Index(v) >= waits_in_.size()) {
      waits_in_.resize(Index(v) + 1, kNowhere);
    }
    if (waits_in_[Index(v)] <= bucket) {
      return;
    }
    size_ += waits_in_[Index(v)] == kNowhere ? 1 : 0;
    waits_in_[Index(v)] = static_cast<int16_t>(bucket);
    if (static_cast<size_t>(bucket) >= buckets_.size()) {
      buckets_.resize(bucket + 1);
    }
    buckets_[bucket].push_back(v);
    lowest_ = bucket < lowest_ ? bucket : lowest_;
  }

  // Whether `v` waits in a bucket below `bucket`.
  bool WaitsBelow(VertexId v, int bucket) const { return Index(v) < waits_in_.size() && waits_in_[Index(v)] < bucket; }

  // Whether a vertex may wait below `bucket`: never right after Pop took one from there, until one is added.
  bool HasBelow(int bucket) const { return lowest_ < bucket; }

  bool Waits(VertexId v) const { return Index(v) < waits_in_.size() && waits_in_[Index(v)] != kNowhere; }

  // How many vertices wait.
  size_t size() const { return size_; }

  // What the schedule takes in memory, but for what has moved on.
  uint64_t MemoryBytes() const { return waits_in_.size() * sizeof(int16_t) + size_ * sizeof(VertexId); }

  // Calls f(VertexId) for vertices that wait in `bucket`, the lowest where any do, in the order in which they will be
  // taken if none is added, until it returns false. One may be seen twice.
  template <typename F>
  void ForEachNext(int bucket, F&& f) const {
    const std::vector<VertexId>& waiting = buckets_[bucket];
    for (size_t i = waiting.size(); i-- > 0;) {
      if (waits_in_[Index(waiting[i])] == bucket && !f(waiting[i])) {
        return;
      }
    }
  }

  // Takes a vertex from the lowest bucket; false when none waits.
  bool Pop(VertexId& v, int& bucket) {
    for (; static_cast<size_t>(lowest_) < buckets_.size(); ++lowest_) {
      while (!buckets_[lowest_].empty()) {
        v = buckets_[lowest_].back();
        buckets_[lowest_].pop_back();
        if (waits_in_[Index(v)] == lowest_) {  // else it has moved to a lower bucket since
          waits_in_[Index(v)] = kNowhere;
          --size_;
          bucket = lowest_;
          return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr int16_t kNowhere = std::numeric_limits<int16_t>::max();

  int first_exponent_;
  int lowest_ = 0;
  size_t size_ = 0;
  std::vector<std::vector<VertexId>> buckets_;
  std::vector<int16_t> waits_in_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SCHEDULE_H_
