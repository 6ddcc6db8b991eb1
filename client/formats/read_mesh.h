// Meshes from files.
//
// Formats:
//   vtu   VTK's XML, pieces of triangles in the plane z = 0 or of tetrahedra; arrays in ascii, inline in base64, or
//         appended as bytes or in base64, compressed by zlib, LZ4, LZMA or not; either byte order. Weights are the
//         point data "weights". With the cell data "boundary", lines beside triangles, and triangles beside tetrahedra,
//         are the boundary where it is not 0.
//   vtk   The same in VTK's legacy format, ascii or binary, of the kinds UNSTRUCTURED_GRID and POLYDATA.
//   vtp   VTK's XML of polygons, which are triangles in the plane z = 0.
//   npz   numpy's archive of arrays: `points` of floating-point numbers of 4 or 8 bytes or whole ones, vertices x
//         dimension; `simplices` of whole numbers, simplices x (dimension + 1); of either byte order, in C or Fortran
//         order; weights are `weights`, as many numbers as there are vertices. Others are ignored.
//         Those of the boundary, see write_mesh.h, are read if `facets` is there.
//   node  TetGen's and Triangle's pair of .node and .ele, given by either name. Weights are the only attribute of .node
//         if the comment "# weights" stands before its header. If points have markers, facets with a marker other than
//         0 of .edge (2-D) or .face beside them are the boundary.
//   msh   Gmsh's, 2.2 or 4.1, in ascii or little-endian binary: the tetrahedra or, if there are none, the
//         triangles in the plane z = 0; vertices are all nodes, in the order of the file. Lines beside triangles, and
//         triangles beside tetrahedra, are the boundary if they are of a physical group; points are skipped; other
//         elements, also those of higher order, are refused. Weights are the $NodeData "weights".
//   medit INRIA's .mesh in ascii, of triangles, which in dimension 3 are in the plane z = 0, or of tetrahedra; edges in
//         2-D, and triangles in 3-D, with another reference than 0 are the boundary; all else in it is skipped.
//   adcirc  ADCIRC's fort.14 or SCHISM's grid, of triangles: its boundaries are parts with tags from 1 on, in their
//         order, or as write_mesh.h has them. Of barriers the front is read.
//   2dm   SMS's 2-D meshes of triangles, cards in any order: strings (NS) are parts with their numbers as tags, or from
//         1 on; materials are regions.
//
// Regions are where write_mesh.h says; in .msh that is the first physical group of a simplex, or 0. If all simplices
// are of 0, nothing is told of regions. In .ele all first attributes have to be whole numbers of 32 bits. Parts of a
// file that are left out are told in Mesh::notes.
#ifndef WELLSPACE_CLIENT_FORMATS_READ_MESH_H_
#define WELLSPACE_CLIENT_FORMATS_READ_MESH_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// Whether numbers of simplices, the data of cells of VTK's formats, are kept. One of several numbers is NAME:0, NAME:1
// and so on.
enum class SimplexData { kLeaveOut, kKeep };

// Reads the mesh of `path`; standard input ("-") is vtu.
//
// Guarantees: coordinates are those of the file, to the bit; every index of a simplex is that of a vertex. Nothing else
//             is checked: the simplices need not form a mesh.
// Errors:     of opening and reading; INVALID_ARGUMENT "FILE:LINE: …" for anything but such a mesh.
absl::StatusOr<Mesh> ReadMesh(const std::string& path, SimplexData data = SimplexData::kLeaveOut);

// The name of the format in which ReadMesh reads `path`; empty: none.
std::string MeshFormatOf(const std::string& path);

// The files that ReadMesh reads: `path`, or a pair.
std::vector<std::string> FilesOfMeshRead(const std::string& path);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_READ_MESH_H_
