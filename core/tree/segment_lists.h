// The segments that meet the nodes of a quadtree.
#ifndef WELLSPACE_CORE_TREE_SEGMENT_LISTS_H_
#define WELLSPACE_CORE_TREE_SEGMENT_LISTS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"

namespace wellspace::core {

// The input segments that meet the closed cube of each leaf. A list changes only when its leaf is split: it has whole
// segments, not the parts into which vertices split them. A segment is listed wherever rounding leaves a doubt.
//
// Thread safety: thread-compatible; const functions may run at once.
class SegmentLists {
 public:
  using Ends = std::array<Point<2>, 2>;

  // More segments than these make a leaf crowded, unless all of them have a common end: splitting would never end.
  static constexpr size_t kCapacity = 8;

  bool IsEmpty() const { return segments_.empty(); }
  size_t count() const { return segments_.size(); }

  // Lists these segments at node 0, if there are any, and none elsewhere.
  void Begin(std::vector<Ends> segments) {
    *this = {};
    if (segments.empty()) {
      return;
    }
    segments_ = std::move(segments);
    listed_.resize(segments_.size());
    std::iota(listed_.begin(), listed_.end(), 0);
    lists_.assign(1, {0, static_cast<uint32_t>(segments_.size())});
  }

  const Ends& segment(uint32_t number) const { return segments_[number]; }

  // The segments that meet a leaf, ascending.
  std::span<const uint32_t> Of(NodeId leaf) const {
    if (Index(leaf) >= lists_.size()) {
      return {};
    }
    const List& list = lists_[Index(leaf)];
    return {listed_.data() + list.begin, list.count};
  }

  // Hands the list of `parent` down to its children, which are numbered from `first_child` on.
  void HandDown(NodeId parent, NodeId first_child, std::span<const Box<2>> cubes) {
    lists_.resize(Index(first_child) + cubes.size());
    const List own = std::exchange(lists_[Index(parent)], {});
    unused_ += own.count;
    for (size_t child = 0; child < cubes.size(); ++child) {
      const auto begin = static_cast<uint32_t>(listed_.size());
      for (uint32_t i = own.begin; i < own.begin + own.count; ++i) {
        const Ends& ends = segments_[listed_[i]];
        if (!SurelyMisses(ends[0], ends[1], cubes[child])) {
          listed_.push_back(listed_[i]);
        }
      }
      lists_[Index(first_child) + child] = {begin, static_cast<uint32_t>(listed_.size() - begin)};
    }
    if (unused_ > listed_.size() / 2) {
      DropUnused();
    }
  }

  bool IsCrowded(NodeId leaf) const {
    const std::span<const uint32_t> own = Of(leaf);
    return own.size() > kCapacity && !(AllEndAt(own, segments_[own[0]][0]) || AllEndAt(own, segments_[own[0]][1]));
  }

  uint64_t MemoryBytes() const {
    return segments_.size() * sizeof(Ends) + lists_.size() * sizeof(List) + listed_.size() * sizeof(uint32_t);
  }

 private:
  struct List {
    uint32_t begin = 0;  // in listed_
    uint32_t count = 0;
  };

  bool AllEndAt(std::span<const uint32_t> own, const Point<2>& p) const {
    return std::all_of(own.begin(), own.end(),
                       [&](uint32_t s) { return segments_[s][0] == p || segments_[s][1] == p; });
  }

  void DropUnused() {
    HugeVector<uint32_t> kept;
    kept.reserve(2 * (listed_.size() - unused_));
    for (List& list : lists_) {
      const auto begin = static_cast<uint32_t>(kept.size());
      kept.insert(kept.end(), listed_.begin() + list.begin, listed_.begin() + list.begin + list.count);
      list.begin = begin;
    }
    listed_ = std::move(kept);
    unused_ = 0;
  }

  std::vector<Ends> segments_;
  HugeVector<List> lists_;  // by node; of nodes that have been split, and beyond the last, empty
  HugeVector<uint32_t> listed_;
  size_t unused_ = 0;  // of listed_
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_SEGMENT_LISTS_H_
