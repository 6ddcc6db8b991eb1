// The schedule S of [HT08] Figure 4: vertices in buckets by the length of their next short edge, the shortest first.
#ifndef WELLSPACE_CORE_REFINE_SCHEDULE_H_
#define WELLSPACE_CORE_REFINE_SCHEDULE_H_

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/ids.h"

namespace wellspace::core {

// Thread safety: thread-compatible.
// Invariants: (1) a vertex waits in one bucket at most; (2) Pop takes from the lowest bucket that is not empty, the
// last come first.
class Schedule {
 public:
  // Lengths are told apart from `shortest` up; `base` is the ratio of one bucket's lengths to those of the one before.
  Schedule(double shortest, double base) : shortest_(shortest), base_(base), log_base_(std::log(base)) {}

  int BucketOf(double length) const {
    return length > shortest_ ? static_cast<int>(std::log(length / shortest_) / log_base_) : 0;
  }
  // The length at which `bucket` ends.
  double UpperLength(int bucket) const { return shortest_ * std::pow(base_, bucket + 1); }

  // Puts `v` in the bucket of `length`, unless it waits in that one or a lower one already.
  void Add(VertexId v, double length) { AddToBucket(v, BucketOf(length)); }

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

  // How many vertices wait.
  size_t size() const { return size_; }

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

  double shortest_;
  double base_;
  double log_base_;
  int lowest_ = 0;
  size_t size_ = 0;
  std::vector<std::vector<VertexId>> buckets_;
  std::vector<int16_t> waits_in_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SCHEDULE_H_
