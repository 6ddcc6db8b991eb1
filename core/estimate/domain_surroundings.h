// The surroundings of a place of a domain in the plane: segments, and the face that it lies in.
#ifndef WELLSPACE_CORE_ESTIMATE_DOMAIN_SURROUNDINGS_H_
#define WELLSPACE_CORE_ESTIMATE_DOMAIN_SURROUNDINGS_H_

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "core/base/ids.h"
#include "core/base/run_context.h"
#include "core/estimate/near_segments.h"
#include "core/geometry/point.h"
#include "core/refine/plane/planar_domain.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// Looks at the segments that the leaf of a place lists and at no others: segments farther away than the leaf's side
// hardly count. Faces are those of the nearest segment, as far as doubles tell.
//
// Thread safety: thread-compatible.
class DomainSurroundings {
 public:
  // REQUIRES:   both outlive this; the tree has the segments of the domain, of which there is one at least.
  DomainSurroundings(const LeafTree<2>& tree, const PlanarDomain& domain) : tree_(tree), domain_(domain) {}

  // Finds the faces of leaves that no segment meets. To be called first.
  //
  // Complexity: O(L + s) for L leaves that list s segments in all.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Prepare(const RunContext& context);

  // From now on places are in `leaf`.
  //
  // Complexity: O(s log s) for s segments in the leaf.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status MoveTo(NodeId leaf, const RunContext& context);

  // Distances from a place to segments of the face that it lies in; infinite where there is no such segment.
  struct Found {
    double two_segments = std::numeric_limits<double>::infinity();  // to the farther of two without a common end
    double with_point = std::numeric_limits<double>::infinity();    // to the nearest that does not end at the point
    uint32_t face = 0;
  };

  // `point`: the vertex that is nearest to `x`.
  //
  // Complexity: O(log s) for most places, and that of NearSegments for cells that are cut.
  Found LookAt(const Point<2>& x, VertexId point);

  const Face& face(uint32_t number) const { return domain_.faces().faces[number]; }

  // Segments that have been compared with places, or with parts of a leaf, in all; the cost of looking.
  uint64_t compared() const;

 private:
  static constexpr uint32_t kNoFace = ~uint32_t{0};

  // The segments of a leaf on one face, in which places are looked for.
  struct Group {
    std::span<const uint32_t> segments;
    NearSegments* near = nullptr;  // of them, if they are many
  };

  // The face on the side of `segment` that a place at this distance is on.
  uint32_t FaceBeside(uint32_t segment, const SegmentDistance& distance) const {
    return domain_.faces().left_face[HalfEdgeOf(segment, distance.away < 0)];
  }
  // The face of `x`, to which `segment` is the nearest.
  uint32_t FaceBesideNearest(const Point<2>& x, uint32_t segment, const SegmentDistance& distance) const;
  // The face of `x` by the nearest of these segments.
  uint32_t FaceAt(const Point<2>& x, std::span<const uint32_t> segments);
  absl::Status FindFacesOfLeaves(const RunContext& context);
  Group GroupOf(uint32_t face);

  const LeafTree<2>& tree_;
  const PlanarDomain& domain_;
  std::vector<uint32_t> face_of_leaf_;  // by node; kNoFace where segments meet it
  NodeId leaf_ = NodeId{0};
  std::span<const uint32_t> segments_;  // of leaf_
  // Where these are many: all of them, and those beside each face.
  std::optional<NearSegments> near_;
  std::vector<std::pair<uint32_t, uint32_t>> by_face_;                         // faces and segments, ascending
  std::vector<uint32_t> beside_faces_;                                         // the segments of by_face_
  absl::flat_hash_map<uint32_t, std::unique_ptr<NearSegments>> near_in_face_;  // where they are many
  std::vector<std::pair<SegmentDistance, uint32_t>> few_;                      // scratch
  uint64_t compared_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_DOMAIN_SURROUNDINGS_H_
