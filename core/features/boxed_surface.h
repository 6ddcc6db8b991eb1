// Triangles that are cut at the sides of a box, and these sides as triangles, too, so that all of it bounds solids.
#ifndef WELLSPACE_CORE_FEATURES_BOXED_SURFACE_H_
#define WELLSPACE_CORE_FEATURES_BOXED_SURFACE_H_

#include <cstdint>
#include <limits>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_complex.h"
#include "core/geometry/box.h"

namespace wellspace::core {

// The markers of the sides of a box: this and the FaceIndex. Given triangles may not have them.
inline constexpr int32_t kFirstSideMarker = std::numeric_limits<int32_t>::min();
constexpr bool IsSideMarker(int64_t marker) {
  return marker >= kFirstSideMarker && marker < int64_t{kFirstSideMarker} + 6;
}

struct BoxedSurface {
  // Of the parts of triangles in the box, and of its sides. `point_of_input`: kNoPoint for points outside; `sources`:
  // kNoSource for triangles of sides; `conflicts`: those of the given complex, too.
  SurfaceComplex complex;
  uint64_t moved_points = 0;       // onto the planes of sides
  uint64_t cut_triangles = 0;      // that have parts in the box and outside
  uint64_t outside_triangles = 0;  // without a part in the box: dropped
  bool do_meet = false;            // parts of triangles meet in a side where they share nothing: sides are left out
};

// Cuts triangles at the sides of `box`, leaves out what is outside of it, and adds its sides: as triangles, whose edges
// are those of the parts in each side. A given triangle that lies in a side takes the place of that part of it.
//
// Points no farther than `weld` from the plane of a side are moved onto it. A place where an edge crosses a side is
// computed with 113 bits and rounded once; no farther than `reach` from the plane of another side it is put onto that.
//
// REQUIRES:   `given` is the result of MakeSurfaceComplex; no marker of it is a side's; the box has a volume.
// Guarantees: (1) no point of the complex that a triangle has is outside of the box; a place where a side is crossed is
//             on its plane, to the bit; (2) parts of two triangles with a common edge have their part of it in common;
//             (3) neither the order of triangles nor that of points changes a bit, as for MakeSurfaceComplex; (4) the
//             triangles of sides have an area, and with given triangles in the sides cover them once, unless do_meet;
//             seen from outside they are counterclockwise.
// Complexity: O((n + m) log (n + m)).
// Errors:     RESOURCE_EXHAUSTED of the context's memory, which is asked for before the work, beside `held` bytes;
//             CANCELLED, DEADLINE_EXCEEDED.
// Source:     Sutherland, Hodgman: Reentrant polygon clipping, 1974; docs/design/surfaces.md.
absl::StatusOr<BoxedSurface> CutAtBox(const SurfaceComplex& given, const Box<3>& box, double weld, double reach,
                                      uint64_t held, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_BOXED_SURFACE_H_
