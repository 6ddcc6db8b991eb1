// The node of a SurfaceIndex at which queries of each node of the vertices' octree begin.
#ifndef WELLSPACE_CORE_TREE_SURFACE_NODES_H_
#define WELLSPACE_CORE_TREE_SURFACE_NODES_H_

#include <cstdint>

#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"

namespace wellspace::core {

class SurfaceIndex;

// For each node of the octree the smallest node of the index whose cube equals or holds the node's: both have cubes of
// one grid. It is handed down when a leaf is split, so that no query has to come from the root.
//
// Thread safety: thread-compatible; const functions may run at once.
class SurfaceNodes {
 public:
  bool IsEmpty() const { return index_ == nullptr; }

  // Gives node 0 of the octree the root of `index`, which has to outlive this.
  void Begin(const SurfaceIndex& index) {
    index_ = &index;
    nodes_.assign(1, 0);
  }

  // REQUIRES:   the node has been handed one.
  uint32_t Of(NodeId node) const { return nodes_[Index(node)]; }

  // Hands the node of `parent`, which is on that level of the octree, down to its eight children, which are numbered
  // from `first_child` on.
  void HandDown(NodeId parent, int level, NodeId first_child);

  uint64_t MemoryBytes() const { return nodes_.size() * sizeof(uint32_t); }

 private:
  const SurfaceIndex* index_ = nullptr;
  HugeVector<uint32_t> nodes_;  // by node of the octree
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_SURFACE_NODES_H_
