// A closed surface around triangles that bound nothing by themselves: soups, overlaps, holes.
#ifndef WELLSPACE_CORE_INPUT_SURFACE_WRAP_H_
#define WELLSPACE_CORE_INPUT_SURFACE_WRAP_H_

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_complex.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A closed surface without self-intersections, whose triangles go counterclockwise as seen from outside. Not all of its
// points are corners.
struct SurfaceWrap {
  std::vector<Point<3>> points;
  std::vector<std::array<uint32_t, 3>> triangles;
  double lost_area = 0;  // of given triangles that it passes by, though nothing surrounds them
};

// Of the parts of a wrap those are dropped that are within so many cells along each axis, unless there is no other.
inline constexpr double kLeastPart = 3;

// The surface that parts the points with a winding number above 1/2 from the others, on a grid with cells of `cell`: of
// the negative winding number where the triangles bound a negative volume. Each cell is cut into six tetrahedra, in
// each of which that surface is a triangle or two. Their corners lie where an edge of a tetrahedron crosses a triangle,
// a tenth of the edge from its ends at least; at holes, where the number is 1/2. Parts thinner than a cell may be lost,
// as are those that go the other way than most: lost_area counts their triangles.
//
// The work goes from cells that triangles meet to neighbours, through faces at which both kinds of points are.
//
// REQUIRES:   `box` holds the triangles of the complex; doubles tell tenths of a cell apart at all of its points.
// Guarantees: (1) the result is closed, and meets itself in common corners and edges alone; (2) neither the order of
//             triangles nor that of points changes a bit of it, but for the numbers of points.
// Units:      `unit`: that of the points of the input, for errors.
// Complexity: O(m log m + c log m) for m triangles and c cells at the surface, mostly.
// Errors:     INVALID_ARGUMENT where no point has such a winding number, and for more cells than kMostWrapCells, with
//             the resolution that fits; CANCELLED, DEADLINE_EXCEEDED; those of the context's lender, which is asked for
//             `held` bytes beside those of the cells.
// Source:     docs/design/surfaces.md, soups; Doi and Koide, marching tetrahedra, 1991.
absl::StatusOr<SurfaceWrap> WrapSurface(const SurfaceComplex& complex, const Box<3>& box, double cell, double unit,
                                        uint64_t held, const RunContext& context);

inline constexpr double kMostWrapCells = 2e7;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SURFACE_WRAP_H_
