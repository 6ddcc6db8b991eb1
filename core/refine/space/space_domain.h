// A domain in space as the refinement takes it, like BoxDomain for a cloud.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SPACE_DOMAIN_H_
#define WELLSPACE_CORE_REFINE_SPACE_SPACE_DOMAIN_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/refine/space/space_place.h"
#include "core/refine/space/space_rules.h"
#include "core/refine/space/space_steps.h"
#include "core/refine/space/spatial_domain.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/extra_vertices.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// A handle of a SpatialDomain; box_domain.h explains the names below. One thread refines: queries of curves and of the
// surface by the rules are not recorded.
//
// Thread safety: as SpatialDomain.
class SpaceDomain {
 public:
  static constexpr int kDimension = 3;
  using Place = SpacePlace;
  using Request = SpaceRequest;
  using Rules = SpaceRules;
  template <typename Cells>
  using Steps = SpaceSteps<Cells>;

  // There are no rounds, and so no batches.
  struct Expected {
    Expected(const ExtraVertices<3>& /*positions*/, const std::vector<Request>& /*requests*/) {}
  };

  static constexpr bool kHasFeatures = true;
  static constexpr bool kNotifiesAll = true;
  static constexpr bool kAsksForDistances = true;
  static constexpr bool kMayHaveImages = false;

  // REQUIRES:   `spatial` outlives this and all copies; its vertices are those of the structure.
  explicit SpaceDomain(SpatialDomain& spatial) : spatial_(&spatial) {}

  Rules RulesFor(const QueryStructure<3>& structure, const StepRules<3>& rules, const Expected* /*expected*/) const {
    return {structure, *spatial_, rules};
  }
  size_t LeastInRounds(size_t /*least*/, uint32_t /*vertices*/) const { return std::numeric_limits<size_t>::max(); }
  void MakeRoom(size_t vertices) { spatial_->MakeRoom(vertices); }
  void Added(const Place& place) { spatial_->AddVertex(place); }
  bool AreInOrder(std::span<const Request> /*requests*/) const { return true; }
  uint64_t MemoryBytes() const { return spatial_->MemoryBytes(); }

 private:
  SpatialDomain* spatial_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SPACE_DOMAIN_H_
