// A domain in the plane as the refinement takes it, as BoxDomain is for a cloud.
#ifndef WELLSPACE_CORE_REFINE_PLANE_PLANE_DOMAIN_H_
#define WELLSPACE_CORE_REFINE_PLANE_PLANE_DOMAIN_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/refine/plane/expected_vertices.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_place.h"
#include "core/refine/plane/plane_rules.h"
#include "core/refine/plane/plane_steps.h"
#include "core/refine/plane/split_place.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// A handle of a PlanarDomain, which has segments, faces, and the places of vertices; box_domain.h explains the names
// below.
//
// Thread safety: as PlanarDomain.
class PlaneDomain {
 public:
  static constexpr int kDimension = 2;
  using Place = PlanePlace;
  using Request = PlaneRequest;
  using Rules = PlaneRules;
  using Expected = ExpectedVertices;
  template <typename Cells>
  using Steps = PlaneSteps<Cells>;

  static constexpr bool kHasFeatures = true;
  static constexpr bool kNotifiesAll = true;
  static constexpr bool kAsksForDistances = true;
  static constexpr bool kMayHaveImages = true;

  // REQUIRES:   `planar` outlives this and all copies; its vertices are those of the structure.
  explicit PlaneDomain(PlanarDomain& planar) : planar_(&planar) {}

  Rules RulesFor(const QueryStructure<2>& structure, const StepRules<2>& rules, const Expected* expected) const {
    return {structure, *planar_, rules, expected};
  }
  // Turns among strips make more vertices where there are few: neighbours along a curve fit worse.
  size_t LeastInRounds(size_t least, uint32_t vertices) const {
    return vertices < kFewVertices ? std::max(least, kLeastOfFew) : least;
  }
  void MakeRoom(size_t vertices) { planar_->MakeRoom(vertices); }
  void Added(const Place& place) { planar_->AddVertex(place.on, place.face); }
  bool HasImages() const { return planar_->sides().HasAxes(); }
  template <typename F>
  void ForEachImage(const Request& request, F f) const {
    const SegmentPoint image = planar_->ImageOf(request.place.on);
    if (image.IsOnSegment()) {
      f(planar_->PositionOf(image), Place{.on = image});
    }
  }
  bool AreInOrder(std::span<const Request> requests) const { return AreSplitsInOrder(*planar_, requests); }
  uint64_t MemoryBytes() const { return planar_->MemoryBytes(); }

 private:
  static constexpr uint32_t kFewVertices = 32768;
  static constexpr size_t kLeastOfFew = 4096;

  PlanarDomain* planar_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_PLANE_DOMAIN_H_
