// The features of a domain in space, as they are given: triangles, holes and regions.
#ifndef WELLSPACE_CORE_FEATURES_SURFACE_FEATURES_H_
#define WELLSPACE_CORE_FEATURES_SURFACE_FEATURES_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "core/features/part_names.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The rule by which solids, into which triangles cut space, are meshed.
enum class SolidRule : uint8_t {
  kEvenOdd,  // the places that an odd number of triangles separates from infinity
  kHoles,    // all bounded ones but those with a hole
  kWinding,  // the places that triangles go around more often than 1/2 times, which need not bound them: a wrap does
  kBox,      // all of a box, whose sides bound it beside the triangles, but for solids with a hole
};

// Whether all solids but the unbounded one are meshed, as far as no hole says otherwise.
constexpr bool MeshesAllBounded(SolidRule rule) { return rule == SolidRule::kHoles || rule == SolidRule::kBox; }

// The default resolution of a wrap, by the diagonal of the surface's bounding box.
inline constexpr double kWrapResolution = 0.005;

// A statement on the solid that a point lies in.
struct SolidSeed {
  Point<3> at{};
  bool is_hole = false;                                         // the solid is not meshed
  int32_t region = 0;                                           // of the simplices in the solid, unless a hole
  double max_volume = std::numeric_limits<double>::infinity();  // of a simplex there; a cubed length
};

// Triangles and seeds beside n given points. The spans have to outlive this.
struct SurfaceFeatures {
  std::span<const uint32_t> corners;  // m x 3, row-major: indices of points
  std::span<const int32_t> markers;   // m, or none: then all are 0
  std::span<const SolidSeed> seeds;
  SolidRule solids = SolidRule::kEvenOdd;
  std::optional<Box<3>> box{};  // of kBox: triangles are cut at its sides; none otherwise
  double crease_angle = 30;     // less than between the normals at a crease; 180: none. Unit: degrees
  double weld = 0;              // points no farther than this from each other become one; a length
  double resolution = 0;        // the cell of a wrap; a length, 0: kWrapResolution times the diagonal
  double min_patch = 0;         // patches smaller than its square join a neighbour; a length, 0: 1 % of the diagonal
  const PartNames* names = nullptr;  // null: the default ones
  bool keeps_points = false;         // corners of triangles at meshed solids are vertices, as points on no triangle are

  size_t triangle_count() const { return corners.size() / 3; }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SURFACE_FEATURES_H_
