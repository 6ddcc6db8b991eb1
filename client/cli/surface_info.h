// The report of the tool on a surface.
#ifndef WELLSPACE_CLIENT_CLI_SURFACE_INFO_H_
#define WELLSPACE_CLIENT_CLI_SURFACE_INFO_H_

#include <string>

#include "client/formats/surface/surface.h"
#include "client/json/json.h"
#include "core/input/surface_report.h"

namespace wellspace::cli {

// file, kind ("surface"), format, dimension, triangles, points, low, high, parts, cut_polygons, weld, welded_points,
// flat_triangles, flat_example, equal_triangles, equal_example, flipped_triangles, flipped_example, one_sided,
// inside_out, loose_points, components, area, lost_area, volume, solids, membranes, curves, corners, patches,
// sharpest_angle_deg, sharpest_at, faults. Values that faults leave open are null.
client::Json SurfaceJson(const std::string& path, const formats::Surface& surface,
                         const core::SurfaceFeatures& features, const core::SurfaceReport& report);

// The same for a user, a line each, on standard output.
void PrintSurface(const client::Json& json);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SURFACE_INFO_H_
