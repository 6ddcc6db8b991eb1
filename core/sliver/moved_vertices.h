// The vertices of a mesh that repair has moved since it was made.
#ifndef WELLSPACE_CORE_SLIVER_MOVED_VERTICES_H_
#define WELLSPACE_CORE_SLIVER_MOVED_VERTICES_H_

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/ids.h"

namespace wellspace::core {

// Vertices that have moved, of the first ones: those of the last mesh.
//
// Thread safety: thread-compatible.
class MovedVertices {
 public:
  // The mesh has so many vertices; it never has fewer.
  void GrowTo(uint64_t count) { has_moved_.resize(std::max<uint64_t>(count, has_moved_.size()), false); }

  // `v` has moved; one beyond the mesh does not count.
  void Note(VertexId v) {
    if (Index(v) < has_moved_.size() && !has_moved_[Index(v)]) {
      has_moved_[Index(v)] = true;
      moved_.push_back(v);
    }
  }

  // Returns them, ascending, and forgets them.
  //
  // Complexity: O(k log k) for k of them.
  std::vector<VertexId> Take() {
    std::ranges::sort(moved_);
    for (const VertexId v : moved_) {
      has_moved_[Index(v)] = false;
    }
    return std::exchange(moved_, {});
  }

  bool empty() const { return moved_.empty(); }
  uint64_t MemoryBytes() const { return has_moved_.size() / 8 + moved_.size() * sizeof(VertexId); }

 private:
  std::vector<bool> has_moved_;  // by vertex
  std::vector<VertexId> moved_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_MOVED_VERTICES_H_
