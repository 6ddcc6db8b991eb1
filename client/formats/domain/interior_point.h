// A point inside a polygon. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_INTERIOR_POINT_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_INTERIOR_POINT_H_

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace wellspace::formats {

// A point that an odd number of rings surround, about as far from them as one of some horizontal lines through the
// polygon has it; none if the polygon is flat.
//
// Shapes:     positions: n x 2; ring r has those from ring_starts[r] up to ring_starts[r + 1] or n, and is closed.
// Guarantees: it lies strictly between two edges of the polygon on a horizontal line that has no vertex, so far as the
//             roundings of their crossings with that line let it.
// Complexity: O(n log n).
std::optional<std::array<double, 2>> InteriorPoint(std::span<const double> positions,
                                                   const std::vector<size_t>& ring_starts);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_INTERIOR_POINT_H_
