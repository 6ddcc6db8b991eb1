// Clouds of points from files.
//
// Formats:
//   csv   One point a line; fields separated by commas, semicolons, or blanks and tabs, as the first line has them, and
//         quoted where they contain separators. A first line of words is a header. When it names coordinates, those are
//         read: x, y and z; lon, lat and a height; easting, northing and a height; Points:0, Points:1, ...; with
//         "point", "coord" and the like around them and a unit in brackets, in any case. Otherwise, or when
//         CloudOptions::dimension is above 3, every column is a coordinate. "//" before the names, as CloudCompare has
//         it, and names in a comment before the first row are understood, too.
//   xyz   The same, but without names columns after the third are skipped, or after as many as CloudOptions::dimension
//         if that is above 3. Or as in chemistry: the number of points, a line of comment, then that many lines, each
//         of which may start with a symbol.
//   asc   As xyz, without chemistry.
//   pts   Leica's: the number of points, then so many lines as in xyz; again and again. The number may be missing.
//   node  TetGen's and Triangle's: "points dimension attributes markers", then a line "index x y [z ...] attributes
//         marker" for each point, counted from 0 or 1.
//   npy   numpy's: one array, points x dimension, of floating-point numbers of 4 or 8 bytes or whole numbers of 1 to 8,
//         of either byte order, in C or Fortran order.
//   ply   Stanford's, in ascii or in binary of either byte order: the properties x, y and, if it is there, z of the
//         element "vertex", of any scalar type. Other properties and the elements before it are skipped, lists too.
//   obj   Wavefront's: two or three coordinates in each line "v"; what follows them (a weight, a colour) is skipped, as
//         are all other lines. A line that ends in a backslash goes on in the next one.
//   off   Geomview's in ascii: "OFF", the numbers of vertices, faces and edges, then a line for each vertex. Letters
//         before OFF announce numbers after the coordinates, which are skipped: ST texture, C colour, N normal. 4OFF
//         has four coordinates, all taken as they are; nOFF says how many before the counts. Lower case will do, but
//         for N and n.
//   stl   In ascii, in any case, or binary: the corners of the triangles, each once; -0 is 0. A number of triangles of
//         0 stands for all that follow.
//   pcd   The Point Cloud Library's: fields x, y and, if it is there, z; data in ascii, binary or binary_compressed.
//   las   1.0 to 1.4 of the ASPRS, point formats 0 to 10; points that are marked as withheld are left out. Compressed
//         ones (laz) are refused: docs/adr/0034-laz-is-refused.md.
//   vtk   VTK's legacy format in ascii or binary, of the kinds POLYDATA, UNSTRUCTURED_GRID, STRUCTURED_GRID,
//         STRUCTURED_POINTS and RECTILINEAR_GRID.
//   vtp, vts, vtu, vtr, vti  VTK's XML, the points of all pieces, arrays as ReadMesh takes them. Of grids and images
//         whose points are told by their axes alone, at most 2^20 points and 64 for each byte of the file.
//   pvtp, pvts, pvtu, pvtr, pvti  VTK's files of pieces, each of which is a file beside it; points that pieces have in
//         common come as often.
//   msh   Gmsh's, versions as ReadMesh takes them: all nodes, whatever the elements are.
//   medit INRIA's .mesh in ascii: all vertices, whatever the elements are.
//   npz   numpy's archive of arrays: the rows of `points`, as npy.
//   adcirc, 2dm  All nodes in the plane, whatever the elements are; "depth" or "elevation" is beside them.
// Of ply, off, msh, medit and adcirc, nothing behind the last point is looked at.
// Points of vtk, the formats of VTK's XML, msh and medit that all have z = 0 are taken in the plane, unless three
// dimensions or columns are asked for: these formats have a third coordinate there, too.
// In those of text lines end in LF, CRLF or CR, '#' at the start of a line or after a blank starts a comment, and blank
// lines are skipped. Numbers may have Fortran's exponents: 1.0D+00, 1.0-100. Each may be compressed by gzip, as
// "cloud.csv.gz" or on standard input.
#ifndef WELLSPACE_CLIENT_FORMATS_READ_CLOUD_H_
#define WELLSPACE_CLIENT_FORMATS_READ_CLOUD_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/cloud.h"

namespace wellspace::formats {

struct CloudOptions {
  std::string format = "";  // empty: by the file's extension; standard input is csv
  int dimension = 0;  // that the file must have; 0: as many as it has columns, of a table without names at most three
  // The columns that hold the coordinates, in this order: names, in any case, or numbers counted from 1. Empty: see
  // above. Columns of ply are the properties of its vertices; those of node, obj, off and npy the coordinates, which
  // are x, y, z up to 3-D. Columns of pcd, las, vtk, vtp and vtu are coordinates and attributes; one of several numbers
  // is NAME:0, NAME:1 and so on.
  std::vector<std::string> columns = {};
  // Leave out points of which a coordinate is missing (an empty field, NA and the like), NaN, infinite or too large for
  // a double, and count them; otherwise the first one is an error.
  bool skip_invalid = false;
  // Keep the attributes of points: see PointCloud::attributes. Of tables, columns that a header names.
  bool keep_attributes = false;
};

// The names that CloudOptions::format may take.
std::vector<std::string> CloudFormats();

// The name of the format in which ReadCloud reads `path` if CloudOptions::format is `format`; empty: none.
std::string CloudFormatOf(const std::string& path, const std::string& format);

// Reads the points of `path`, in the order of the file; "-" is standard input.
//
// Guarantees: coordinates are correctly rounded, to the bit.
//             Every line of text is a point, a header, a comment, counted in PointCloud::skipped, or an error.
// Complexity: one pass; memory for the points, and a buffer of at most about a line; twice the points for an array in
//             Fortran order.
// Errors:     of opening and reading; INVALID_ARGUMENT "FILE:LINE: …" for anything but a cloud of finite points of one
//             dimension (2 to 6), and for a file of text without points when `dimension` is 0.
absl::StatusOr<PointCloud> ReadCloud(const std::string& path, const CloudOptions& options = {});

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_READ_CLOUD_H_
