// Rasters whose cells have a size each, as sizes at the centres of the cells. Private to this folder and read_sizes.cc.
#ifndef WELLSPACE_CLIENT_FORMATS_RASTER_RASTER_SIZES_H_
#define WELLSPACE_CLIENT_FORMATS_RASTER_RASTER_SIZES_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client/formats/read_sizes.h"

namespace wellspace::formats {

// Where a raster lies: its first cell is at the upper left, and the rows go down.
struct RasterFrame {
  uint64_t columns = 0;
  uint64_t rows = 0;
  double x = 0;  // of the centre of the first cell
  double y = 0;
  double width = 0;   // of a cell
  double height = 0;  // of a cell
};

// Takes the values of cells one after the other, row by row.
//
// Thread safety: thread-compatible.
class RasterSizes {
 public:
  // Cells of the value `nodata`, and of NaN, have no size. REQUIRES: `sized` outlives this.
  RasterSizes(const RasterFrame& frame, std::optional<double> nodata, SizedPoints& sized)
      : frame_(frame), nodata_(nodata), sized_(sized) {}

  void Add(double value);
  uint64_t count() const { return cells_; }
  // Notes how many cells have no size.
  void Finish();

 private:
  const RasterFrame frame_;
  const std::optional<double> nodata_;
  SizedPoints& sized_;
  uint64_t cells_ = 0;
};

// INVALID_ARGUMENT unless there are columns and rows, fewer cells than 2^32, and a cell has a width and a height.
absl::Status CheckFrame(const std::string& name, const RasterFrame& frame);

// ESRI's grid in ascii: ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter, cellsize or dx and dy, perhaps
// NODATA_value; then the values from the upper row down, in lines of any length.
//
// Guarantees: (1) cells without data are left out and noted; (2) the places of points are numbers of cells from 0.
// Errors:     of opening and reading; INVALID_ARGUMENT at a line.
absl::Status ReadEsriGrid(const std::string& path, SizedPoints& sized);

// The first image of a GeoTIFF, of one band, in strips or tiles, not compressed, by LZW, deflate or PackBits; with a
// tie point and a scale, or a transformation; nodata as GDAL has it (tag 42113).
//
// Guarantees: as of ReadEsriGrid; blocks that are left out have no data.
// Memory:     the file, and the points.
// Errors:     of opening and reading; INVALID_ARGUMENT.
absl::Status ReadGeoTiff(const std::string& path, SizedPoints& sized);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_RASTER_RASTER_SIZES_H_
