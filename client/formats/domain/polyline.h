// Rings and lines of positions, as points and segments of a domain. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_POLYLINE_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_POLYLINE_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "client/formats/cloud.h"
#include "client/formats/domain/planar_domain.h"

namespace wellspace::formats {

// How many different positions there are; 3 if there are more.
//
// Shapes:     positions: n x 2.
int CountDifferent(std::span<const double> positions);

// Whether a ring encloses nothing: it has fewer than three different positions, they are all on one line, or each of
// its edges is there an even number of times.
//
// Shapes:     positions: n x 2, the first repeated at the end or not.
// Guarantees: exact.
// Complexity: O(n); O(n log n) of rings whose area is little beside the terms of its sum.
bool IsFlat(std::span<const double> positions);

// Adds the points and segments of a ring or a line to the domain.
//
// Shapes:     positions: n x 2, n >= 1; lines: where each of them stands, of n, or null for 0 to n - 1.
// Guarantees: (1) positions that are equal to the one before are dropped, and counted. (2) A ring is closed, and one
//             that was not is counted; a line is if its last position is its first, which is one point then. (3) The
//             points and the segments follow each other in the order of the positions, and segment i begins at point i.
// Errors:     a message without a location, if there are too many points.
absl::Status AddPolyline(std::span<const double> positions, const LineIndex* lines, bool is_ring, PlanarDomain& domain);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_POLYLINE_H_
