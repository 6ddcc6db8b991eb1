// Surfaces of files as triangles and solids for a server.
#ifndef WELLSPACE_CLIENT_FILES_SURFACE_FEATURES_H_
#define WELLSPACE_CLIENT_FILES_SURFACE_FEATURES_H_

#include <span>
#include <string>
#include <vector>

#include "client/formats/surface/surface.h"
#include "client/types.h"

namespace wellspace::client {

// Corners of STL that are no farther apart than this share of the diagonal are one point.
inline constexpr double kWeldShare = 1e-6;

// The length for `surface`; 0 where triangles share corners by numbers.
//
// Complexity: O(n) for n points.
double DefaultWeld(const formats::Surface& surface);

// The triangles and solids of the file, and `more_seeds` behind its own seeds; corners are welded within DefaultWeld.
// Attributes of regions that are no whole numbers of 32 bits become regions by numbers of their own, which is added to
// `notes`.
//
// Complexity: O(n + m log m) for n points and triangles and m seeds.
// Errors:     none.
SurfaceFeatures FeaturesOf(const formats::Surface& surface, std::span<const formats::Surface::Seed> more_seeds,
                           std::vector<std::string>& notes);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_FILES_SURFACE_FEATURES_H_
