// What a domain in space is bounded by and made of, as it is given: triangles, holes and regions.
#ifndef WELLSPACE_CORE_FEATURES_SURFACE_FEATURES_H_
#define WELLSPACE_CORE_FEATURES_SURFACE_FEATURES_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/geometry/point.h"

namespace wellspace::core {

// Which of the solids, into which triangles cut space, are meshed.
enum class SolidRule : uint8_t {
  kEvenOdd,  // those that an odd number of triangles separates from infinity
  kHoles,    // all bounded ones but those with a hole
};

// What is said of the solid that a point lies in.
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
  double crease_angle = 30;  // between the normals at a crease, at least; 180: none. Unit: degrees
  double weld = 0;           // points no farther than this from each other become one; a length
  double min_patch = 0;      // patches smaller than its square join a neighbour; a length, 0: 1 % of the diagonal

  size_t triangle_count() const { return corners.size() / 3; }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SURFACE_FEATURES_H_
