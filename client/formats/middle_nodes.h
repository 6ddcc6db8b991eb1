// The nodes that a mesh of second order has beside its vertices. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_MIDDLE_NODES_H_
#define WELLSPACE_CLIENT_FORMATS_MIDDLE_NODES_H_

#include <algorithm>
#include <cstdint>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// A node at the middle of each edge of a mesh, whichever simplices and facets share it. They are numbered behind the
// vertices, by the lower end of their edge, then by the higher one.
//
// Memory:     4 bytes for each edge of each simplex and facet while they are found, 4 for each edge after that, and 8
//             for each vertex.
// Thread safety: immutable.
class MiddleNodes {
 public:
  // Of the edges of all simplices and facets of `mesh`, in 2-D or 3-D. The ends of an edge may be equal.
  //
  // Complexity: O(edges), and a sort of those at each vertex.
  // Errors:     INVALID_ARGUMENT for a vertex that the mesh does not have, or more nodes than 32 bits number;
  //             CANCELLED once `stop` asks for it.
  static absl::StatusOr<MiddleNodes> Of(const MeshView& mesh, const std::stop_token& stop);

  uint64_t count() const { return highs_.size(); }

  // The node at the middle of an edge of the mesh.
  uint32_t NodeOf(uint32_t a, uint32_t b) const {
    const auto [low, high] = std::minmax(a, b);
    const auto begin = highs_.begin() + first_[low];
    const auto at = std::lower_bound(begin, highs_.begin() + first_[uint64_t{low} + 1], high);
    return static_cast<uint32_t>(vertex_count() + (at - highs_.begin()));
  }

  // Calls `use` with the lower and the higher end of each edge, in the order of the nodes, until it returns an error.
  template <typename Use>
  absl::Status ForEachEdge(Use use) const {
    for (uint64_t low = 0; low < vertex_count(); ++low) {
      for (uint64_t i = first_[low]; i < first_[low + 1]; ++i) {
        if (absl::Status status = use(static_cast<uint32_t>(low), highs_[i]); !status.ok()) {
          return status;
        }
      }
    }
    return absl::OkStatus();
  }

 private:
  MiddleNodes() = default;

  uint64_t vertex_count() const { return first_.size() - 1; }

  std::vector<uint64_t> first_{0};  // of the vertices' edges to higher ones, in highs_; and the end
  std::vector<uint32_t> highs_;     // the higher ends of all edges, in ascending order at each vertex
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MIDDLE_NODES_H_
