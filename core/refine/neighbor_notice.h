// The news of a vertex for its neighbours once it has been added: made by the steps, taken by PendingVertices::Notify.
#ifndef WELLSPACE_CORE_REFINE_NEIGHBOR_NOTICE_H_
#define WELLSPACE_CORE_REFINE_NEIGHBOR_NOTICE_H_

#include "core/base/ids.h"

namespace wellspace::core {

// A neighbour that may have to be looked at again, in view of a node that its cell shares with that of a new vertex.
struct NeighborNotice {
  VertexId vertex = kNoVertex;
  double edge_sq = 0;           // the squared distance between the two
  bool is_on_boundary = false;  // the node lies on a face of the box; in a domain true of every node
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_NEIGHBOR_NOTICE_H_
