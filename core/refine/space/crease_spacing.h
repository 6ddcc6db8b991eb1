// Distances between vertices on an acute curve.
#ifndef WELLSPACE_CORE_REFINE_SPACE_CREASE_SPACING_H_
#define WELLSPACE_CORE_REFINE_SPACE_CREASE_SPACING_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/point.h"
#include "core/refine/space/corner_sectors.h"
#include "core/refine/space/patch_bends.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

struct CurveDemands;

// Distances on a surface, and the spacings of acute curves that follow from them.
//
// Thread safety: thread-compatible.
class CreaseSpacing {
 public:
  // REQUIRES:   all references outlive this; the index of the domain is built.
  CreaseSpacing(const SpatialDomain& domain, const CurveDemands& demands, const RunContext& context)
      : domain_(domain), demands_(demands), context_(context), bends_(domain) {}

  // `is_acute`: by curve; outlives this.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Begin(const std::vector<bool>& is_acute);

  // Whether a patch is flat within what is demanded.
  //
  // REQUIRES:   Begin has been called.
  bool IsFlat(uint32_t patch) const { return bends_.IsFlat(patch); }

  // RESOURCE_EXHAUSTED for more vertices than are allowed.
  absl::Status TooManyVertices() const;

  // The distance of `p` from the nearest of the curves for which counts(curve) is true; at most `most`.
  //
  // Complexity: O(log edges of curves) mostly.
  double DistanceToCurves(const Point<3>& p, double most, const std::function<bool(uint32_t)>& counts) const;
  // The distance of `p` from the nearest patch that is not in an ascending list; at most `most`.
  //
  // Complexity: that of SurfaceIndex::NearestOf.
  double DistanceToPatches(const Point<3>& p, double most, std::span<const uint32_t> but) const;

  // `radius`, of the ball of a corner with these sectors, or less, so that curves and patches there are as near to
  // chords as is demanded.
  //
  // Complexity: O(points of curves in the ball + sectors) a halving.
  double RadiusForBends(uint32_t corner, std::span<const CornerSector> sectors, double radius) const;

  // The lengths of arc of vertices on a curve from one to another, both included; of a loop without corners, where
  // these are 0 and its length, the last is left out.
  //
  // Complexity: O(vertices) distances.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED; RESOURCE_EXHAUSTED for more vertices than are allowed.
  absl::StatusOr<std::vector<double>> ArcsAlong(uint32_t curve, double from, double to) const;

 private:
  struct Sample {
    double arc = 0;
    double spacing = 0;
  };
  struct CurveEdge {
    uint32_t curve = 0;
    std::array<uint32_t, 2> points{};
  };

  double SpacingAt(uint32_t curve, double arc, double from, double to) const;
  double SpacingAtCorner(uint32_t curve, const Point<3>& p, double way, uint32_t corner, double most) const;
  absl::StatusOr<std::vector<Sample>> Samples(uint32_t curve, double from, double to, bool is_loop) const;
  double SpacingForBends(uint32_t curve, double arc, double most) const;
  bool HasCommonCorner(uint32_t curve, uint32_t other) const;

  const SpatialDomain& domain_;
  const CurveDemands& demands_;
  const RunContext& context_;
  PatchBends bends_;
  const std::vector<bool>* is_acute_ = nullptr;
  std::vector<std::array<uint32_t, 2>> corners_;  // by curve: those at its ends, or kNoCorner
  std::vector<CurveEdge> edges_;
  BoxTree<3> tree_;  // of edges
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_CREASE_SPACING_H_
