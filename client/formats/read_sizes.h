// Sizes at points from files.
//
// Formats:
//   csv   A table as in read_cloud.h, of coordinates and a size. With a header the sizes are the column "h" or "size",
//         in any case; the others are the coordinates, or those among them that have names of coordinates. Without a
//         header the last column has the sizes.
//   vtu   As in read_mesh.h, with point data "h".
//   msh   The same, with $NodeData "h".
//   npz   The same, with an array `h`; `simplices` may be missing.
//   esri  ESRI's grid in ascii, .asc, of sizes in the plane: each cell has the size of its centre, those without data
//         none, which is noted.
//   geotiff  GeoTIFF of one band, .tif, as esri: in strips or tiles, not compressed, by LZW, deflate or PackBits; whole
//         or floating-point numbers. Its place is that of a tie point and a scale, or of a transformation.
// Tables and rasters may be compressed by gzip.
#ifndef WELLSPACE_CLIENT_FORMATS_READ_SIZES_H_
#define WELLSPACE_CLIENT_FORMATS_READ_SIZES_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/cloud.h"

namespace wellspace::formats {

// Points with a size each.
struct SizedPoints {
  PointCloud cloud;           // of the points; its origins say where each was read, of a raster the cells from 0 on
  std::vector<double> sizes;  // of each, above 0 and finite
};

struct SizeOptions {
  // Points are left out of which a coordinate or the size is missing, NaN or infinite; how many is in `skipped` and in
  // a note.
  bool skip_invalid = false;
  // Sizes are interpolated linearly between the vertices of the simplices of a mesh, rather than grow from its vertices
  // alone: points are added between them. This is how fast circumradii grow with the distance from a point; a size is
  // `radius_of_size` of these.
  std::optional<double> growth_to_interpolate{};
  double radius_of_size = 1;
};

// Reads the sizes of `path` at points of `dimension`, in the order of the file; those that are added come last.
//
// Complexity: one pass over the file; memory for all.
// Errors:     of opening and reading; INVALID_ARGUMENT "FILE:LINE: …" or "FILE[POINT]: …" for anything but sizes at
//             finite points of this dimension, and for a file without any; and to interpolate for a file without
//             simplices, or for more points than 10 million.
absl::StatusOr<SizedPoints> ReadSizes(const std::string& path, int dimension, const SizeOptions& options = {});

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_READ_SIZES_H_
