// What is around a place of a domain in the plane: segments, and the face that it lies in.
#ifndef WELLSPACE_CORE_ESTIMATE_DOMAIN_SURROUNDINGS_H_
#define WELLSPACE_CORE_ESTIMATE_DOMAIN_SURROUNDINGS_H_

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/point.h"
#include "core/refine/domain/planar_domain.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// Looks at the segments that the leaf of a place lists and at no others: what is farther away than the leaf is large
// hardly counts. Faces are those of the nearest segment, as far as doubles tell.
//
// Thread safety: thread-compatible.
class DomainSurroundings {
 public:
  // REQUIRES:   both outlive this; the tree has the segments of the domain, of which there is one at least.
  // Complexity: O(L + s) for L leaves that list s segments.
  DomainSurroundings(const LeafTree<2>& tree, const PlanarDomain& domain);

  // From now on places are in `leaf`.
  void MoveTo(NodeId leaf) {
    leaf_ = leaf;
    segments_ = tree_.segments().Of(leaf);
  }

  // Distances from a place to segments of the face that it lies in; infinite where there is no such segment.
  struct Found {
    double two_segments = std::numeric_limits<double>::infinity();  // to the farther of two without a common end
    double with_point = std::numeric_limits<double>::infinity();    // to the nearest that does not end at the point
    uint32_t face = 0;
  };

  // `point`: the vertex that is nearest to `x`.
  //
  // Complexity: O(s^2) for s segments in the leaf.
  Found LookAt(const Point<2>& x, VertexId point) const;

  const Face& face(uint32_t number) const { return domain_.faces().faces[number]; }

 private:
  static constexpr uint32_t kNoFace = ~uint32_t{0};

  struct Distance {
    double distance = 0;
    double away = 0;  // from the line through the segment, with a sign
  };
  Distance DistanceTo(const Point<2>& x, uint32_t segment) const;
  bool EndsAt(uint32_t segment, VertexId v) const {
    return domain_.EndVertex(segment, false) == v || domain_.EndVertex(segment, true) == v;
  }
  // The face on the side of `segment` that a place at this distance is on.
  uint32_t FaceBeside(uint32_t segment, const Distance& distance) const {
    return domain_.faces().left_face[HalfEdgeOf(segment, distance.away < 0)];
  }
  uint32_t FaceAt(const Point<2>& x, std::span<const uint32_t> segments) const;
  // The faces of leaves that no segment meets: from neighbour to neighbour.
  void FindFacesOfLeaves();

  const LeafTree<2>& tree_;
  const PlanarDomain& domain_;
  std::vector<uint32_t> face_of_leaf_;  // by node; kNoFace where segments meet it
  NodeId leaf_ = NodeId{0};
  std::span<const uint32_t> segments_;  // of leaf_
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_DOMAIN_SURROUNDINGS_H_
