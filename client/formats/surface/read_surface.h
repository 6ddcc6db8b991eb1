// Surfaces in 3-D from files.
//
// Formats:
//   stl    In ascii, in any case, or binary. Corners that are equal to the bit are one point; -0 is 0. Each name behind
//          "solid" is a part, whose triangles have the marker 1, 2, … in the order of the names' first appearance;
//          triangles of solids without a name, and of files in binary, have 0.
//   obj    Wavefront's: vertices ("v"), faces ("f"), whose indices count from 1 or, negative, from the last one back.
//          A name of a group ("g") or, outside of groups, of an object ("o") is a part, as in stl. All other lines are
//          skipped.
//   ply    Stanford's, in ascii or in binary of either byte order: x, y and z of the element "vertex", and of the
//          element "face" the list vertex_indices or vertex_index. A property of faces that is called tag, marker or
//          label, a whole number, is the marker.
//   off    Geomview's in ascii; see ReadCloud. A face is the number of its corners, these, and a colour: one whole
//          number, an index into a map of colours, is taken for the marker; three or four numbers are skipped.
//   smesh  TetGen's. Points as in a .node file; if there are 0 of them, they are in the .node file beside it. Then
//          "facets markers" and a line "corners corner … [marker]" for each facet; the number of holes and a line
//          "index x y z" for each; the number of regions and a line "index x y z attribute [max-volume]" for each. The
//          file may end after any part. Solids: kHoles.
//   poly   TetGen's in 3-D: as smesh, but a facet is a line "polygons [holes] [marker]" and then a line for each
//          polygon. Facets of one polygon without holes are read; others are an error.
// Faces of more than three corners are cut into triangles, in the projection along the axis that is nearest to their
// normal: those that are convex as fans from their first corner, others, which must not cross themselves, ear by ear.
// In those of text lines end in LF, CRLF or CR, and '#' at the start of a line or after a blank starts a comment. Each
// may be compressed by gzip, as "part.stl.gz" or on standard input.
#ifndef WELLSPACE_CLIENT_FORMATS_SURFACE_READ_SURFACE_H_
#define WELLSPACE_CLIENT_FORMATS_SURFACE_READ_SURFACE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/surface/surface.h"

namespace wellspace::formats {

// The names that the format of a surface may have.
std::vector<std::string> SurfaceFormats();

// Whether a file has a surface, and is no cloud, unless an option says so: .stl, .smesh, and .poly whose first line
// says that it is in 3-D; also with .gz.
bool IsSurfacePath(const std::string& path);

// Reads the surface of `path` in `format`, or if that is empty in the one that its extension says; "-" is standard
// input, which has none.
//
// Guarantees: (1) coordinates are correctly rounded, to the bit, and finite; corners are points;
//             (2) every triangle and every seed has its place in the file;
//             (3) memory is asked for as the file has things, never as it announces them.
// Complexity: one pass; memory for the surface, and for one polygon. A polygon of n corners that is not convex takes
//             O(n^2) for most, never more than O(n^3).
// Errors:     of opening and reading; INVALID_ARGUMENT "FILE:LINE: …", in binary "FILE: byte …", for what is not such a
//             file: a number that is none or not finite, a corner that is no point, a polygon of fewer than three
//             corners or that crosses itself, other counts than announced, an end in the middle; and for a file without
//             triangles.
absl::StatusOr<Surface> ReadSurface(const std::string& path, const std::string& format = "");

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SURFACE_READ_SURFACE_H_
