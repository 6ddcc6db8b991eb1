// Polygons as triangles of a surface, and names as markers. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_BUILDER_H_
#define WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_BUILDER_H_

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/formats/surface/surface.h"

namespace wellspace::formats {

// Thread safety: thread-compatible.
class SurfaceBuilder {
 public:
  // REQUIRES:   `surface` outlives this.
  explicit SurfaceBuilder(Surface& surface) : surface_(surface) {}

  // Adds a polygon over points that the surface has, which was read at `place`, a line or a row.
  //
  // Errors:     a message without a location: fewer than three corners; it cannot be cut into triangles.
  absl::Status AddPolygon(std::span<const uint32_t> corners, int32_t marker, uint64_t place);

  // The marker of the part with this name: 1, 2, … in the order of their first appearance; 0 for "".
  int32_t MarkerOf(std::string_view name);

 private:
  Surface& surface_;
  std::map<std::string, int32_t, std::less<>> marker_of_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_BUILDER_H_
