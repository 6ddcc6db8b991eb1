// Sizes between the vertices of a mesh that have one. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_SIZES_BETWEEN_H_
#define WELLSPACE_CLIENT_FORMATS_SIZES_BETWEEN_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace wellspace::formats {

// By how much, relatively, sizes that grow from points are above those that are interpolated, at most.
inline constexpr double kAboveInterpolated = 0.1;

// Points with sizes, of which some are vertices of simplices.
struct SizesBetween {
  int dimension = 0;
  std::vector<double> points;  // n x dimension, row-major
  std::vector<double> sizes;   // n, above 0 and finite
  std::vector<uint64_t> rows;  // n: the row of the file that each is from; of an added one that of a vertex near it
};

// Adds points on the edges of `simplices`, with sizes that are interpolated linearly along these, so many that sizes
// which grow from points stand for the interpolation: edges are halved, the longest of each simplex first.
//
// Shapes:     simplices: rows of dimension + 1 points. Simplices with a point that `is_left_out` are not looked at.
// Units:      growth: of a circumradius, per distance; `radius_of_size`: a circumradius, per size.
// REQUIRES:   indices are points; those that are not left out have a size above 0.
// Guarantees: (1) at every place of a simplex, the least over all points of size + growth * distance, as circumradii,
//             is at most 1 + kAboveInterpolated times the size that is interpolated between the vertices of the
//             simplex; (2) no point is added twice.
// Complexity: O(s + a) for s simplices and a points that are added.
// Errors:     INVALID_ARGUMENT, a message without the file, for more than 10 million points, most often before
//             any is made.
absl::Status AddSizesBetween(std::span<const uint32_t> simplices, const std::vector<bool>& is_left_out, double growth,
                             double radius_of_size, SizesBetween& sized);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SIZES_BETWEEN_H_
