// The parts of patches between curves that follow each other around a corner.
#ifndef WELLSPACE_CORE_REFINE_SPACE_CORNER_SECTORS_H_
#define WELLSPACE_CORE_REFINE_SPACE_CORNER_SECTORS_H_

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/refine/space/spatial_domain.h"

namespace wellspace::core {

// Points around a corner are no farther apart than this. Unit: degrees.
inline constexpr double kMostTurn = 50;

// The triangles of a patch around a corner from one curve to the next one; or to the same, if there is no other. At the
// tip of a cone, where no curve ends, they go all the way around.
struct CornerSector {
  uint32_t corner = 0;
  uint32_t patch = 0;
  bool is_closed = false;                         // at a tip
  std::array<SpatialDomain::CurveEnd, 2> ends{};  // of no meaning there
  std::vector<Point<3>> rays;  // unit vectors along the edges of the triangles, the first and the last along curves
  std::vector<double> turns;   // by ray: from the first one, in the triangles. Unit: degrees

  // Into how many parts a turn is divided by points.
  int PartsOf(double turn) const;
  // The unit vector in the triangles at a turn from the first ray.
  Point<3> WayAt(double turn) const;
  // The way from an end into the sector, across its curve.
  Point<3> WayInto(int end) const;
};

// The triangles at each corner where no curve ends, the tip of a cone, by its point; ascending.
//
// Complexity: O(triangles log tips).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::map<uint32_t, std::vector<uint32_t>>> FindTips(const SpatialDomain& domain,
                                                                   const RunContext& context);

// The sectors of the corners that are wanted, each once, in an order that the surface decides.
//
// Complexity: O(triangles log triangles).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<CornerSector>> FindCornerSectors(const SpatialDomain& domain,
                                                            const std::vector<bool>& is_wanted,
                                                            const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_CORNER_SECTORS_H_
