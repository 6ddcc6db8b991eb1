// Vertices that a cell is to be cut by though its structure does not hold them: vertices that a batch expects to be
// inserted.
#ifndef WELLSPACE_CORE_VORONOI_EXTRA_VERTICES_H_
#define WELLSPACE_CORE_VORONOI_EXTRA_VERTICES_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// They are numbered in the order in which they come. Vertices that come one after the other tend to be near each other:
// a box around every few tells which may matter.
//
// Thread safety: thread-compatible.
template <int D>
class ExtraVertices {
 public:
  VertexId first() const { return first_; }
  size_t size() const { return positions_.size(); }
  std::span<const Point<D>> positions() const { return positions_; }

  // Forgets all; the first that comes is to be `first`.
  void Clear(VertexId first) {
    CutTo(0);
    first_ = first;
  }

  // Forgets all but the first `size`.
  void CutTo(size_t size) {
    positions_.resize(size);
    boxes_.resize((size + kTogether - 1) / kTogether);  // the last may be larger than it need be
  }

  VertexId Append(const Point<D>& position) {
    const size_t needed = positions_.size() + LeafTree<D>::VertexPool::kReadTogether;
    if (positions_.capacity() < needed) {
      positions_.reserve(2 * needed);
    }
    if (positions_.size() % kTogether == 0) {
      boxes_.push_back({position, position});
    }
    boxes_.back().Include({position, position});
    positions_.push_back(position);
    return VertexId{Index(first_) + static_cast<uint32_t>(positions_.size() - 1)};
  }

  // Calls f(std::span<const Point<D>>, VertexId) for runs of vertices and the first of each, in order: with all that
  // are no farther from `p`, by the square. No run is longer than a leaf's capacity, and all may be read as vertices of
  // one may (VertexPool::kReadTogether).
  //
  // Complexity: O(size / kTogether), and the runs.
  template <typename F>
  void ForEachRunNear(const Point<D>& p, double distance_sq, F&& f) const {
    constexpr size_t kMost = LeafTree<D>::kLeafCapacity / kTogether;
    const auto is_near = [&](size_t i) { return DistanceSq<D>(p, boxes_[i]) <= distance_sq; };
    for (size_t i = 0; i < boxes_.size(); ++i) {
      if (is_near(i)) {
        const size_t begin = i * kTogether;
        const size_t most = std::min(boxes_.size(), i + kMost);
        while (i + 1 < most && is_near(i + 1)) {
          ++i;
        }
        const size_t end = std::min(positions_.size(), (i + 1) * kTogether);
        f(positions().subspan(begin, end - begin), VertexId{Index(first_) + static_cast<uint32_t>(begin)});
      }
    }
  }

 private:
  static constexpr size_t kTogether = 8;
  static_assert(LeafTree<D>::kLeafCapacity % kTogether == 0);

  VertexId first_ = kNoVertex;
  std::vector<Point<D>> positions_;  // with room to be read beyond the last
  std::vector<Box<D>> boxes_;        // around kTogether of them
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_EXTRA_VERTICES_H_
