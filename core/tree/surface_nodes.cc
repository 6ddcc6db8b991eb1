#include "core/tree/surface_nodes.h"

#include <algorithm>
#include <cstddef>

#include "core/tree/surface_index.h"

namespace wellspace::core {

void SurfaceNodes::HandDown(NodeId parent, int level, NodeId first_child) {
  nodes_.resize(std::max(nodes_.size(), size_t{Index(first_child)} + 8));
  const IndexNode own = Of(parent);
  const bool has_children = index_->level(own) == level && !index_->IsLeaf(own);
  for (uint32_t k = 0; k < 8; ++k) {
    nodes_[Index(first_child) + k] = has_children ? index_->Child(own, k) : own;
  }
}

}  // namespace wellspace::core
