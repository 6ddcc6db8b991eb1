// The vertices of the leaves of a tree, each leaf's side by side, in memory by their number.
#ifndef WELLSPACE_CORE_TREE_LEAF_VERTICES_H_
#define WELLSPACE_CORE_TREE_LEAF_VERTICES_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The vertices of leaves, at most `kMost` each, by number. A leaf has room for its vertices rounded up to a multiple of
// kTogether, and of an eighth of kMost or less; when that is full it moves, and its old room serves another leaf.
//
// Thread safety: thread-compatible.
template <int D, int kMost>
class LeafVertexPool {
 public:
  // The memory that a vertex takes.
  static constexpr size_t kPlaceBytes = sizeof(Point<D>) + sizeof(VertexId);
  // Positions stay aligned to this number of bytes.
  static constexpr uint32_t kTogether = 4;
  // The number of positions or ids that may be read together, the last perhaps of no vertex.
  static constexpr uint32_t kReadTogether = 8;

  struct LeafVertices {
    uint32_t count = 0;
    uint32_t capacity = 0;
    Point<D>* positions = nullptr;
    VertexId* ids = nullptr;
  };

  // Makes an empty leaf with room for `count` and returns its number.
  uint32_t Add(uint32_t count) {
    uint32_t number = 0;
    if (free_numbers_.empty()) {
      number = static_cast<uint32_t>(leaves_.size());
      leaves_.emplace_back();
    } else {
      number = free_numbers_.back();
      free_numbers_.pop_back();
    }
    leaves_[number] = Take(count);
    return number;
  }

  // Fills an empty leaf, which has room, with vertices at `positions`, numbered from `first` on.
  //
  // Threads: different leaves may be filled at once.
  void Fill(uint32_t number, std::span<const Point<D>> positions, uint32_t first) {
    LeafVertices& leaf = leaves_[number];
    std::copy(positions.begin(), positions.end(), leaf.positions);
    for (uint32_t i = 0; i < positions.size(); ++i) {
      leaf.ids[i] = VertexId{first + i};
    }
    leaf.count = static_cast<uint32_t>(positions.size());
  }

  // Appends `v` at `p`.
  //
  // REQUIRES:   the leaf holds fewer than kMost.
  void Append(uint32_t number, VertexId v, const Point<D>& p) {
    LeafVertices& leaf = leaves_[number];
    if (leaf.count == leaf.capacity) {
      LeafVertices larger = Take(leaf.count + 1);
      std::copy_n(leaf.positions, leaf.count, larger.positions);
      std::copy_n(leaf.ids, leaf.count, larger.ids);
      larger.count = leaf.count;
      GiveBack(leaf);
      leaf = larger;
    }
    leaf.positions[leaf.count] = p;
    leaf.ids[leaf.count] = v;
    ++leaf.count;
  }

  // Calls f(VertexId, const Point<D>&) for the vertices of a leaf that is gone then; f may add leaves and append to
  // others.
  template <typename F>
  void Dissolve(uint32_t number, F&& f) {
    const LeafVertices leaf = leaves_[number];
    leaves_[number] = {};
    free_numbers_.push_back(number);
    for (uint32_t i = 0; i < leaf.count; ++i) {
      f(leaf.ids[i], leaf.positions[i]);
    }
    GiveBack(leaf);
  }

  LeafVertices& operator[](uint32_t number) { return leaves_[number]; }
  const LeafVertices& operator[](uint32_t number) const { return leaves_[number]; }

  // The memory that a leaf takes for `count` vertices.
  static constexpr size_t BytesFor(uint32_t count) {
    return sizeof(LeafVertices) + static_cast<size_t>(ClassOf(count) + 1) * kStep * kPlaceBytes;
  }
  // The memory that a leaf takes beside its vertices, on average: half a step is free.
  static constexpr size_t OverheadBytes() { return sizeof(LeafVertices) + kStep / 2 * kPlaceBytes; }
  uint64_t MemoryBytes() const { return taken_bytes_ + leaves_.size() * sizeof(LeafVertices); }

 private:
  static constexpr uint32_t kStep = kMost / 8 / kTogether * kTogether;
  static constexpr int kClasses = kMost / kStep;
  static_assert(kStep * kClasses == kMost && kStep % 2 == 0, "positions are to stay aligned");
  static constexpr size_t kLeastChunk = std::max<size_t>(size_t{1} << 16, 16 * kMost * kPlaceBytes);
  static constexpr size_t kMostChunk = std::max(kHugePage, kLeastChunk);

  static constexpr uint32_t ClassOf(uint32_t count) { return count == 0 ? 0 : (count - 1) / kStep; }

  LeafVertices Take(uint32_t count) {
    if (count > kMost) {
      std::abort();  // in a tree: more vertices in one cube of the grid than callers may put there
    }
    const uint32_t size_class = ClassOf(count);
    LeafVertices leaf;
    leaf.capacity = (size_class + 1) * kStep;
    std::byte* memory = nullptr;
    if (auto& free = free_[size_class]; !free.empty()) {
      memory = free.back();
      free.pop_back();
    } else {
      const size_t bytes = leaf.capacity * kPlaceBytes;
      if (chunks_.empty() || chunks_.back().get_deleter().count - used_ < bytes + kReadTogether * sizeof(Point<D>)) {
        // As much as there is already: on large pages once that fills one.
        chunks_.push_back(MakeHugePageBytes(std::clamp<size_t>(taken_bytes_, kLeastChunk, kMostChunk)));
        used_ = 0;
      }
      memory = chunks_.back().get() + used_;
      used_ += bytes;
      taken_bytes_ += bytes;
    }
    leaf.positions = reinterpret_cast<Point<D>*>(memory);
    leaf.ids = reinterpret_cast<VertexId*>(memory + leaf.capacity * sizeof(Point<D>));
    return leaf;
  }

  void GiveBack(const LeafVertices& leaf) {
    free_[ClassOf(leaf.capacity)].push_back(reinterpret_cast<std::byte*>(leaf.positions));
  }

  HugeVector<LeafVertices> leaves_;
  std::vector<uint32_t> free_numbers_;
  std::array<std::vector<std::byte*>, kClasses> free_;
  std::vector<HugePageBytes> chunks_;
  size_t used_ = 0;  // of the last chunk
  uint64_t taken_bytes_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_LEAF_VERTICES_H_
