// Finds the acute curves and corners of a surface, and puts vertices on them that hold their angles: AcuteCreases.
#ifndef WELLSPACE_CORE_REFINE_SPACE_CREASE_SAMPLER_H_
#define WELLSPACE_CORE_REFINE_SPACE_CREASE_SAMPLER_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/refine/space/acute_creases.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

// Patches that meet at less than this make a curve acute. Unit: degrees.
inline constexpr double kAcuteAngle = 75;
// Curves that leave a corner at less than this make it acute. Unit: degrees.
inline constexpr double kAcuteCorner = 60;

// The smallest angle of something, from 0 to 180, and where it is. Unit: degrees.
struct PlacedAngle {
  double angle = 180;
  Point<3> at{};
};

// The smallest angles between two patches, by curve, and between two curves, by corner; of the tip of a cone, where no
// curve ends, that at which it opens.
struct CreaseAngles {
  std::vector<PlacedAngle> of_curves;
  std::vector<PlacedAngle> of_corners;
};

// Complexity: O(points of curves log edges).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CreaseAngles> MeasureCreases(const SpatialDomain& domain, const RunContext& context);

// The demands on vertices on curves. Lengths are on the scale of the computation.
struct CurveDemands {
  double edge = 0;       // they are no farther apart
  double tolerance = 0;  // chords of curves are no farther from them, as far as that is above `min_size`
  double min_size = 0;
  uint64_t max_vertices = 0;
};

// Finds the vertices, collar points, strands and shields of acute curves and corners.
//
// The ball of a corner has the largest radius that is a power of two, at most the edge that is demanded, a third of the
// shortest curve there, and half the distance of other curves and patches. Along acute curves vertices are as far apart
// as is demanded, at most a third of the distance to curves with which this one shares no corner, and the distance to
// other patches; near a curve that leaves the same corner at a small angle a share of the distance to that; and from
// the balls at their ends spacings grow by a half of the way. What grows faster than kGrowth is made to grow so. Collar
// points are kCollarShare times the lesser spacing away, or a little more than half of the greater one. Radii and
// spacings are as small as PatchBends says that the tolerance needs.
//
// REQUIRES:   the index of the domain is built; no angle is 0.
// Guarantees: (1) it is empty where nothing is acute; (2) a function of the surface and of the demands.
// Complexity: O(vertices (log curves + triangles nearby)).
// Errors:     CANCELLED, DEADLINE_EXCEEDED; RESOURCE_EXHAUSTED of the context's memory, and for more vertices than are
//             allowed.
// Source:     docs/design/surfaces.md.
absl::StatusOr<AcuteCreases> SampleCreases(const SpatialDomain& domain, const CreaseAngles& angles,
                                           const CurveDemands& demands, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_CREASE_SAMPLER_H_
