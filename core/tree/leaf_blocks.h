// All vertices along the Z curve, in blocks of whole leaves, for threads to share out.
#ifndef WELLSPACE_CORE_TREE_LEAF_BLOCKS_H_
#define WELLSPACE_CORE_TREE_LEAF_BLOCKS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/ids.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// Thread safety: const functions may run at once.
template <int D>
class LeafBlocks {
 public:
  // Blocks of `vertices_in_block` vertices, or a few more. `tree` must not change.
  //
  // Complexity: O(nodes).
  LeafBlocks(const LeafTree<D>& tree, size_t vertices_in_block) : tree_(tree) {
    size_t in_block = vertices_in_block;
    tree.ForEachLeaf([&](NodeId leaf) {
      const auto* inside = tree.VerticesIn(leaf);
      if (inside == nullptr || inside->count == 0) {
        return;
      }
      if (in_block >= vertices_in_block) {
        begin_.push_back(leaves_.size());
        in_block = 0;
      }
      leaves_.push_back(leaf);
      in_block += inside->count;
    });
    begin_.push_back(leaves_.size());
  }

  size_t count() const { return begin_.size() - 1; }
  uint64_t MemoryBytes() const { return leaves_.size() * sizeof(NodeId) + begin_.size() * sizeof(size_t); }

  // Calls f(const LeafTree<D>::LeafVertices&, NodeId) for the leaves of a block.
  template <typename F>
  void ForEachLeafOf(size_t block, F f) const {
    for (size_t i = begin_[block]; i < begin_[block + 1]; ++i) {
      f(*tree_.VerticesIn(leaves_[i]), leaves_[i]);
    }
  }

 private:
  const LeafTree<D>& tree_;
  std::vector<NodeId> leaves_;  // the leaves with vertices
  std::vector<size_t> begin_;   // by block, in leaves_; one more
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_LEAF_BLOCKS_H_
