// The schedule S of [HT08] Figure 4: vertices in buckets by the length of their next short edge, the shortest first.
#ifndef WELLSPACE_CORE_REFINE_SCHEDULE_H_
#define WELLSPACE_CORE_REFINE_SCHEDULE_H_

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/memory/prefetch.h"

namespace wellspace::core {

// Buckets are one power of two of the squared length wide, the square root of 2 in length. (The paper has 2: finer
// buckets make smaller meshes for more work.) Powers of two need no logarithm, so that all machines sort alike.
//
// The vertices of a bucket have come there in several passes over the mesh. So that one pass refines them, a bucket is
// put in order by blocks of vertices that are near each other. That is done once, when all buckets below it have been
// emptied for the first time.
//
// Thread safety: thread-compatible.
// Invariants: (1) a vertex is pending in one bucket at most; (2) Pop takes from the lowest bucket that is not empty.
//             The vertices that came after it was put in order are first; then the last block is; of each the last come
//             first.
class Schedule {
 public:
  // Vertices in a block, if there are not so many that blocks could not be numbered: the data of a block that a scan
  // reads fit into a cache of the second level.
  static constexpr uint32_t kBlockSize = 512;

  // Lengths below `shortest` fall into the lowest bucket.
  explicit Schedule(double shortest) : first_exponent_(std::ilogb(shortest * shortest)) {}

  // REQUIRES:   length_sq is a finite number above zero.
  int BucketOf(double length_sq) const {
    const int exponent = static_cast<int>(std::bit_cast<uint64_t>(length_sq) >> kMantissaBits) - kExponentBias;
    return std::max(0, exponent - first_exponent_);
  }
  // The squared length at which `bucket` ends.
  double UpperLengthSq(int bucket) const {
    return std::bit_cast<double>(static_cast<uint64_t>(first_exponent_ + bucket + 1 + kExponentBias) << kMantissaBits);
  }

  // Has buckets put in order again. Vertices below `count` that are in no block yet are put into blocks by their
  // numbers.
  void Begin(uint32_t count) {
    in_order_ = 0;
    const uint32_t size = std::max(kBlockSize, count / kMostBlocks + 1);
    for (auto v = static_cast<uint32_t>(places_.size()); v < count; ++v) {
      places_.push_back({kNowhere, static_cast<uint16_t>(v / size)});
    }
  }

  // Makes room for so many vertices.
  void Reserve(uint32_t vertices) { places_.reserve(vertices); }

  // Puts `v`, which is new, into the block of `near`.
  void PutBeside(VertexId near, VertexId v) {
    MakeRoomFor(std::max(near, v));
    places_[Index(v)].block = places_[Index(near)].block;
  }

  // Puts `v` in the bucket of a length, unless it is pending in that one or a lower one already.
  void Add(VertexId v, double length_sq) { AddToBucket(v, BucketOf(length_sq)); }

  void AddToBucket(VertexId v, int bucket) {
    MakeRoomFor(v);
    int16_t& pending_in = places_[Index(v)].bucket;
    if (pending_in <= bucket) {
      return;
    }
    size_ += pending_in == kNowhere ? 1 : 0;
    pending_in = static_cast<int16_t>(bucket);
    if (static_cast<size_t>(bucket) >= buckets_.size()) {
      buckets_.resize(bucket + 1);
    }
    buckets_[bucket].push_back(v);
    lowest_ = bucket < lowest_ ? bucket : lowest_;
  }

  // Whether `v` is pending in a bucket below `bucket`.
  bool IsPendingBelow(VertexId v, int bucket) const { return BucketHolding(v) < bucket; }

  // Whether a vertex may be pending below `bucket`: never right after Pop took one from there, until one is added.
  bool HasBelow(int bucket) const { return lowest_ < bucket; }

  bool IsPending(VertexId v) const { return BucketHolding(v) != kNowhere; }

  // How many vertices are pending.
  size_t size() const { return size_; }

  // The memory of the schedule, without entries of vertices that have moved on.
  uint64_t MemoryBytes() const { return places_.size() * sizeof(Place) + size_ * sizeof(VertexId); }

  // The lowest bucket in which a vertex may be pending, -1 if there is none below `end`.
  int Lowest(int end = std::numeric_limits<int>::max()) {
    for (end = std::min(end, static_cast<int>(buckets_.size())); lowest_ < end; ++lowest_) {
      if (!buckets_[lowest_].empty()) {
        if (lowest_ >= in_order_) {
          PutInOrder(buckets_[lowest_]);
          in_order_ = lowest_ + 1;
        }
        return lowest_;
      }
      buckets_[lowest_] = {};
    }
    return -1;
  }

  // At most how many vertices are pending in `bucket`: entries of vertices that have moved on are counted, too.
  size_t MostIn(int bucket) const { return buckets_[bucket].size(); }

  // Takes a vertex from the lowest bucket, if that is below `end`; false when none is pending there.
  bool Pop(VertexId& v, int& bucket, int end = std::numeric_limits<int>::max()) {
    for (int lowest = Lowest(end); lowest >= 0; lowest = Lowest(end)) {
      while (!buckets_[lowest].empty()) {
        v = buckets_[lowest].back();
        buckets_[lowest].pop_back();
        if (IsPendingIn(v, lowest)) {  // else it has moved to a lower bucket since
          Take(v);
          bucket = lowest;
          return true;
        }
      }
    }
    return false;
  }

  // Detaches the vertices of `bucket`, the lowest: they stay pending in it, but without a place in its order, until
  // they are taken or reattached. Returns them: the vertex that would be taken last comes first.
  HugeVector<VertexId> Detach(int bucket) {
    HugeVector<VertexId> detached = std::exchange(buckets_[bucket], {});
    // From the last on each once: a vertex that has been seen is not pending meanwhile.
    size_t first = detached.size();
    for (size_t i = detached.size(); i-- > 0;) {
      const VertexId v = detached[i];
      if (IsPendingIn(v, bucket)) {
        places_[Index(v)].bucket = kNowhere;
        detached[--first] = v;
      }
    }
    detached.erase(detached.begin(), detached.begin() + static_cast<std::ptrdiff_t>(first));
    for (const VertexId v : detached) {
      places_[Index(v)].bucket = static_cast<int16_t>(bucket);
    }
    return detached;
  }

  // Puts a vertex that was detached from `bucket`, and is still pending in it, on top of it.
  void Reattach(VertexId v, int bucket) {
    buckets_[bucket].push_back(v);
    lowest_ = std::min(lowest_, bucket);
  }

  // Detaches a vertex again that was detached from `bucket`, and then taken, unless it is pending in a lower one.
  void DetachAgain(VertexId v, int bucket) {
    size_ += IsPending(v) ? 0 : 1;
    places_[Index(v)].bucket = static_cast<int16_t>(std::min<int>(BucketHolding(v), bucket));
  }

  bool IsPendingIn(VertexId v, int bucket) const { return BucketHolding(v) == bucket; }

  // Asks the memory for the bucket of `v`.
  void Prefetch(VertexId v) const { PrefetchLine(&places_[Index(v)]); }

  // Takes a vertex that is pending from its bucket.
  void Take(VertexId v) {
    places_[Index(v)].bucket = kNowhere;
    --size_;
  }

 private:
  // The format of a double.
  static constexpr int kMantissaBits = 52;
  static constexpr int kExponentBias = 1023;

  static constexpr int16_t kNowhere = std::numeric_limits<int16_t>::max();
  static constexpr uint32_t kMostBlocks = uint32_t{1} << 16;

  struct Place {
    int16_t bucket = kNowhere;
    uint16_t block = 0;
  };

  int16_t BucketHolding(VertexId v) const { return Index(v) < places_.size() ? places_[Index(v)].bucket : kNowhere; }

  void MakeRoomFor(VertexId v) {
    if (Index(v) >= places_.size()) {
      places_.resize(Index(v) + 1);
    }
  }

  // Sorts by block, and leaves the order within each as it is: by counting.
  void PutInOrder(HugeVector<VertexId>& bucket) {
    const auto block_of = [this](VertexId v) -> size_t { return places_[Index(v)].block; };
    std::vector<uint32_t> begins;  // by block
    for (const VertexId v : bucket) {
      begins.resize(std::max(begins.size(), block_of(v) + 1));
      ++begins[block_of(v)];
    }
    std::exclusive_scan(begins.begin(), begins.end(), begins.begin(), uint32_t{0});
    HugeVector<VertexId> sorted(bucket.size());
    for (const VertexId v : bucket) {
      sorted[begins[block_of(v)]++] = v;
    }
    bucket = std::move(sorted);
  }

  int first_exponent_;
  int lowest_ = 0;
  int in_order_ = 0;  // buckets below have been put in order
  size_t size_ = 0;
  std::vector<HugeVector<VertexId>> buckets_;
  HugeVector<Place> places_;  // by vertex
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SCHEDULE_H_
