// The segments near a leaf, by their distance from places in it.
#ifndef WELLSPACE_CORE_ESTIMATE_NEAR_SEGMENTS_H_
#define WELLSPACE_CORE_ESTIMATE_NEAR_SEGMENTS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/refine/plane/planar_domain.h"

namespace wellspace::core {

// How far a segment is from a place.
struct SegmentDistance {
  double distance = 0;
  double away = 0;    // from the line through the segment, with a sign
  double from_a = 0;  // how far along that line the foot is from the segment's end a
};
SegmentDistance DistanceTo(const PlanarDomain& domain, const Point<2>& x, uint32_t segment);

// A quadtree over segments of a domain that is cut where it is asked, and no finer than that needs. So few places cost
// little, however many segments there are.
//
// Thread safety: thread-compatible.
class NearSegments {
 public:
  // No cell of fewer segments is cut.
  static constexpr size_t kTogether = 16;

  // REQUIRES:   `domain` outlives this; every segment meets `leaf`.
  NearSegments(const PlanarDomain& domain, std::span<const uint32_t> segments, const Box<2>& leaf);

  // Calls visit(segment, distance), a bool, for segments by their distance from `x`, those that are as far by number,
  // until it returns false. Where skip(v) is true, segments that end at vertex v may be left out.
  //
  // REQUIRES:   x in the leaf.
  // Complexity: O(log s + k) for s segments, k of them visited or as near; and O(s) for cells that are cut, the first
  //             time that a place among them is looked at.
  template <typename Visit, typename Skip>
  void ForEachFrom(const Point<2>& x, Visit visit, Skip skip) {
    queue_.clear();
    ++visits_;
    queue_.push_back({0, false, 0});
    while (!queue_.empty()) {
      std::pop_heap(queue_.begin(), queue_.end(), std::greater<>());
      const Entry next = queue_.back();
      queue_.pop_back();
      if (next.is_segment) {
        if (!visit(segments_[next.number], found_[next.number])) {
          return;
        }
      } else if (const VertexId common = cells_[next.number].common; common == kNoVertex || !skip(common)) {
        Open(x, next.number);
      }
    }
  }

  // Segments that have been compared with a cell or a place, in all: the cost of looking.
  uint64_t compared() const { return compared_; }

 private:
  static constexpr uint32_t kUncut = ~uint32_t{0};
  static constexpr int kMostDepth = 24;

  struct Cell {
    Box<2> box;
    std::vector<uint32_t> segments;  // places in segments_; none once it is cut
    uint32_t first_child = kUncut;
    VertexId common = kNoVertex;  // where all of them end, if they do
    int depth = 0;
  };
  // An entry that is to be looked at: a segment or a cell, which is no farther than anything in it.
  struct Entry {
    double distance = 0;
    bool is_segment = false;  // cells first, so that all that is as far is known
    uint32_t number = 0;

    auto operator<=>(const Entry&) const = default;
  };

  // Puts the segments and parts of a cell into the queue.
  void Open(const Point<2>& x, uint32_t cell);
  void Cut(uint32_t cell);
  VertexId CommonEnd(std::span<const uint32_t> segments) const;

  const PlanarDomain& domain_;
  const std::vector<uint32_t> segments_;  // ascending
  std::vector<Cell> cells_;
  std::vector<Entry> queue_;            // a heap
  std::vector<uint32_t> visited_;       // by segment: in which visit it was last put into the queue
  std::vector<SegmentDistance> found_;  // by segment, of that visit
  uint32_t visits_ = 0;
  uint64_t compared_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_NEAR_SEGMENTS_H_
