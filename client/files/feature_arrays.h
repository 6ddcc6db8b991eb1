// Domains of files as arrays of numpy, for programs that hand them to a mesher themselves.
#ifndef WELLSPACE_CLIENT_FILES_FEATURE_ARRAYS_H_
#define WELLSPACE_CLIENT_FILES_FEATURE_ARRAYS_H_

#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "client/formats/cloud.h"
#include "client/types.h"

namespace wellspace::client {

// Writes a domain in the plane to a .npz: `points`; `segments`, numbers of points, and of each its `markers`, and
// `is_open` and `groups` if it has them; `faces`, the name of the rule. Seeds are `holes` (x, y), `seeds` (x, y,
// region, largest area) and `polygons` (first segment, segments, region, largest area); without a bound it is infinite.
// Names of parts are `marker_names` of `named_markers`, and `region_names` of `named_regions`.
//
// Errors:     of opening and writing; INVALID_ARGUMENT for what is no regular file.
absl::Status WriteFeatureArrays(const std::string& path, const formats::PointCloud& points, const Features& features,
                                std::stop_token stop);

// The same of a surface in space: `triangles` in the place of segments, and their `markers`; `solids`; `weld`; `holes`
// (x, y, z) and `seeds` (x, y, z, region, largest volume).
absl::Status WriteFeatureArrays(const std::string& path, const formats::PointCloud& points,
                                const SurfaceFeatures& features, std::stop_token stop);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_FILES_FEATURE_ARRAYS_H_
