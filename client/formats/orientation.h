// On which side of its first facet the last vertex of a simplex lies. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_ORIENTATION_H_
#define WELLSPACE_CLIENT_FORMATS_ORIENTATION_H_

#include <span>

namespace wellspace::formats {

// The sign of the determinant of the edges from the last vertex: 1, -1, or 0 for a flat simplex. The core's own sign is
// out of reach: this library does not link the core.
//
// Shapes:     corners: 3 points of 2 coordinates or 4 of 3, row-major.
// Guarantees: exact.
// Complexity: a few multiplications; arithmetic of integers where these do not decide.
// REQUIRES:   finite coordinates.
int OrientationSign(std::span<const double> corners);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_ORIENTATION_H_
