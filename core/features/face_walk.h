// A walk over the faces of a planar graph, which knows whose rings are around each. Private to core/features.
#ifndef WELLSPACE_CORE_FEATURES_FACE_WALK_H_
#define WELLSPACE_CORE_FEATURES_FACE_WALK_H_

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/features/odd_sets.h"
#include "core/features/planar_faces.h"
#include "core/features/planar_graph.h"

namespace wellspace::core {

// Goes from face to face, over a tree of segments that it crosses there and back.
//
// REQUIRES:   left_face is known of both sides of every segment; graph, faces and context outlive this.
// Thread safety: thread-compatible; const functions may run at once.
class FaceWalk {
 public:
  FaceWalk(const PlanarGraph& graph, const PlanarFaces& faces, const RunContext& context)
      : graph_(graph), faces_(faces), context_(context), first_side_(faces.faces.size() + 1) {
    for (const uint32_t face : faces.left_face) {
      ++first_side_[face + 1];
    }
    std::partial_sum(first_side_.begin(), first_side_.end(), first_side_.begin());
    sides_.resize(faces.left_face.size());
    std::vector<uint32_t> next(first_side_.begin(), first_side_.end() - 1);
    for (HalfEdge h = 0; h < sides_.size(); ++h) {
      sides_[next[faces.left_face[h]]++] = h;
    }
  }

  // Calls visit(face, its half-edges) for each face, the unbounded one first. On the way there from the face before it
  // calls toggle(owner) for each owner of a ring that is crossed. `owners` has sets of them, of which `set_of`(segment)
  // is that of a segment.
  //
  // Complexity: O(f + m), and O(k log k) for the k owners of all segments that are crossed.
  // Errors:     those of `visit`; CANCELLED, DEADLINE_EXCEEDED.
  template <typename SetOf, typename Toggle, typename Visit>
  absl::Status Run(const OddSets& owners, const SetOf& set_of, const Toggle& toggle, const Visit& visit) const {
    struct Stop {
      uint32_t face;
      HalfEdge entered_by;
      uint32_t next;
    };
    std::vector<bool> is_visited(faces_.faces.size());
    std::vector<Stop> way;
    uint32_t steps = 0;
    const auto cross = [&](HalfEdge h) {
      for (const uint32_t owner : owners.MembersOf(set_of(graph_.segments[SegmentOf(h)]))) {
        toggle(owner);
        ++steps;
      }
    };
    const auto enter = [&](uint32_t face, HalfEdge by) {
      is_visited[face] = true;
      way.push_back({face, by, first_side_[face]});
      return visit(face, std::span<const HalfEdge>(sides_).subspan(first_side_[face],
                                                                   first_side_[face + 1] - first_side_[face]));
    };
    WELLSPACE_RETURN_IF_ERROR(enter(0, 0));
    while (!way.empty()) {
      if (++steps >= kStepsBetweenLooks) {
        steps = 0;
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      Stop& here = way.back();
      if (here.next == first_side_[here.face + 1]) {
        const HalfEdge back = here.entered_by;
        way.pop_back();
        if (!way.empty()) {
          cross(back);
        }
        continue;
      }
      const HalfEdge h = sides_[here.next++];
      if (const uint32_t beyond = faces_.left_face[TwinOf(h)]; !is_visited[beyond]) {
        cross(h);
        WELLSPACE_RETURN_IF_ERROR(enter(beyond, h));
      }
    }
    return absl::OkStatus();
  }

 private:
  static constexpr uint32_t kStepsBetweenLooks = 1024;

  const PlanarGraph& graph_;
  const PlanarFaces& faces_;
  const RunContext& context_;
  std::vector<uint32_t> first_side_;  // by face, in sides_
  std::vector<HalfEdge> sides_;       // by the face on their left
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_FACE_WALK_H_
