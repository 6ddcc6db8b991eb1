// Distances of patches that bend from the facets beside acute creases.
#ifndef WELLSPACE_CORE_REFINE_SPACE_PATCH_BENDS_H_
#define WELLSPACE_CORE_REFINE_SPACE_PATCH_BENDS_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/refine/space/corner_sectors.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

// No vertex is added between an acute curve and its collar points, and in the balls of corners. So these have to be as
// near that what a patch bends there is no more than `most`.
//
// Thread safety: thread-compatible; const functions may run at once.
class PatchBends {
 public:
  // REQUIRES:   the domain outlives this; its index is built.
  explicit PatchBends(const SpatialDomain& domain) : domain_(domain) {}

  // Finds which patches are flat within `most`.
  //
  // Complexity: O(triangles).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Begin(double most, const RunContext& context);

  // Whether a patch is, by Begin.
  bool IsFlat(uint32_t patch) const { return is_flat_[patch]; }

  // The largest distance of patches beside an acute curve from facets between it and collar points, if vertices of the
  // curve are `spacing` apart about `arc`; of samples, and 0 where all patches are flat.
  //
  // Complexity: O(patches) PointAround.
  double BesideCurve(uint32_t curve, double arc, double spacing) const;

  // The same of what is between a corner and points around it at that distance.
  //
  // Complexity: O(1) PointAround.
  double AroundCorner(const CornerSector& sector, double radius) const;

 private:
  const SpatialDomain& domain_;
  std::vector<bool> is_flat_;  // by patch
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_PATCH_BENDS_H_
