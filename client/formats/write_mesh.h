// Meshes to files.
//
// Formats:
//   vtu   VTK's XML, 2-D and 3-D only: arrays inline in base64, compressed by zlib; points padded to 3-D; point data
//         "input", 1 for the vertices that are input points, and "weights", if there are any.
//   vtkhdf  VTK's HDF5, 2-D and 3-D only: as vtu, in chunks compressed by zlib; for VTK 9.1 and later. It is not read
//         back.
//   npz   numpy's archive of arrays: `points` of type Float64, vertices x dimension; `simplices` of type UInt32,
//         simplices x (dimension + 1); `weights` of type Float64, one for each vertex, if there are any; deflated.
//   node  TetGen's and Triangle's pair of .node and .ele, given by either name; indices start at 0. TetGen itself knows
//         3-D only, Triangle 2-D. Weights are the only attribute of .node; the comment "# weights" before
//         its header says so.
//   msh41 Gmsh's MSH 4.1 in binary, little-endian, 2-D and 3-D only: one block of nodes, numbered from 1, and one of
//         triangles or tetrahedra; $NodeData "input", as in vtu, and "weights", if there are any.
//   msh22 The same in MSH 2.2, in ascii; every simplex is of the physical group 1 where nothing is told of regions.
//   medit INRIA's .mesh of version 2 (double precision) in ascii, 2-D and 3-D only: the reference of a vertex is 1 if
//         it is an input point, else 0, that of a simplex is 1. There is no place for weights.
//   vtk   VTK's legacy format, version 3.0 in binary, 2-D and 3-D only: as vtu, arrays of the field of data.
//   xdmf  XDMF 3, 2-D and 3-D only: NAME.xdmf with the grid "mesh", its arrays in NAME.h5, in chunks compressed by
//         zlib; data as vtu. Names of parts and regions as meshio has them in <Information>.
//   su2   SU2's, in ascii, 2-D and 3-D only. There is no place for weights, and none for regions.
//   abaqus  The .inp of Abaqus and CalculiX, 2-D (CPS3) and 3-D (C3D4) only; *NSET "input" of the input points, *ELSET
//         of the simplices by their regions. There is no place for weights. Their readers take 20 characters of a
//         number: the shortest form of a coordinate if that fits, else the nearest number of so many. A mesh of which
//         a simplex would lose its orientation by that is refused.
//   adcirc  ADCIRC's fort.14, which SCHISM reads as well, 2-D only. The depth of a node is the attribute "depth" or,
//         with the other sign, "elevation"; -99999 where that is missing, 0 everywhere without both. There is no place
//         for weights, and none for regions.
//   2dm   SMS's 2-D meshes: the z of a node is the attribute "elevation" or, with the other sign, "depth"; else 0.
//         There is no place for weights.
// xdmf, su2 and abaqus are not read back.
//
// With a boundary there are, beside that:
//   vtu, vtkhdf  its facets as cells after the simplices; cell data "region" and "boundary" (the tag), 0 where there is
//         none; point data "origin", below 0 for vertices that are no input points (SignedOrigin), and "boundary".
//   npz   `facets`, `facet_tags`, `facet_names` with their tags in `facet_name_tags`, `regions`, `vertex_origins`,
//         `vertex_tags`.
//   node  .edge in 2-D, .face above, with markers; .poly up to 3-D; tags of vertices as markers of .node; the region as
//         attribute of .ele.
//   msh41, msh22  physical groups with names: one of each part, with its tag as number, and one of the simplices.
//   medit Edges in 2-D, Triangles in 3-D, with their tags as references.
//   vtk   as vtu, "origin" of 32 bits.
//   xdmf  NAME_boundary.xdmf with the grid "boundary" of facets, which have their tag as cell data "boundary"; its
//         arrays in NAME_boundary.h5.
//   su2   markers; those of parts without facets are left out.
//   adcirc  strings of nodes, of edges with a triangle on one side alone: open ones of parts whose names start with
//         "open" or "ocean", the others of land, with the type that a name such as "land 0" says, or 20, or 21 of a
//         ring around a hole. Tags and names stand behind the numbers, as names.h has them.
//   2dm   NS of the nodes of each part, with the tag as number.
//   abaqus  *NSET of the vertices and *SURFACE of the sides of elements, one each of every part.
// Labels of su2 and abaqus are names as Labels makes them (labels.h).
//
// Attributes of vertices, which input points have and others have not, are numbers of 8 bytes, NaN where there is none:
// point data of vtu, vtkhdf, vtk and xdmf under their names, "attribute_NAME" in npz. Other formats leave them out.
//
// A part of a larger mesh (mesh_part.h) is held by vtu and npz alone. vtu: point data "GlobalPointIds", "owner", "row"
// and "vtkGhostType", cell data "GlobalCellIds", "owner" and "vtkGhostType". npz: `vertex_ids`, `vertex_owners`,
// `vertex_rows`, `simplex_ids`, `simplex_owners`, `facet_ids`, and `part`: the numbers of the part, of parts, of own
// vertices and of own simplices.
//
// Of a mesh with periodic axes each vertex on the low side across one has its partner on the high side. msh41, msh22:
// $Periodic, of the entity of each high side its nodes, the low side's, and the translation; they go with the boundary,
// which has these entities. npz: `periodic_x`, `periodic_y`, `periodic_z`, a row for each pair, the vertex of the low
// side first, ascending by it. Middle nodes of second order are paired as well.
//
// Edges along the creases of a surface are `ridges` of npz, and Edges that Ridges names of medit.
//
// Of second order (MeshOrder) vertices are followed by the nodes at the middles of edges, ordered by the ends of these,
// the lower one first; data of vertices tell the mean of the ends of them, "origin" -4, and the least tag of a facet of
// their edge. vtu, vtkhdf, vtk and xdmf have quadratic triangles, tetrahedra and edges (22, 24, 21; Triangle_6,
// Tetrahedron_10, Edge_3), abaqus CPS6 and C3D10, msh41 and msh22 the types 9, 11 and 8, of whose tetrahedra the last
// two nodes change places. npz has more columns in `simplices` and `facets`, in VTK's order, and the ends of each edge
// in `middle_ends`. node has what Triangle and TetGen write with -o2: .ele, and .face in 3-D; .edge has ends alone, and
// .poly is left out. Readers of the other formats take no such elements.
//
// Where regions are told, each simplex has the id of its own: cell data "region" of vtu, vtkhdf and vtk; `regions` of
// npz, with names in `region_names` for the ids in `region_ids`; the attribute of .ele; the reference of medit; the
// material of 2dm. In msh41 and msh22 each region is a physical group with its id and a name, whatever the numbers of
// parts of the boundary: Gmsh counts groups by their dimensions. With several regions, in msh41 each is an entity with
// a block of its own: simplices stand by regions in ascending order, otherwise in the order in which they came. Names
// of parts and regions that have no other place: see names.h.
#ifndef WELLSPACE_CLIENT_FORMATS_WRITE_MESH_H_
#define WELLSPACE_CLIENT_FORMATS_WRITE_MESH_H_

#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// The names that `format` may take below.
std::vector<std::string> MeshFormats();

// The extension that files of `format` have, with its dot; empty for an unknown format.
std::string ExtensionOfMesh(const std::string& format);

// Whether a mesh in `path` and `format` has attributes of its vertices.
bool HasPlaceForAttributes(const std::string& path, const std::string& format);

// Whether a mesh in `path` and `format` has the pairs of its vertices across periodic axes.
bool HasPlaceForPairs(const std::string& path, const std::string& format);

// The files that WriteMesh makes of `path` and `format`: that one, or a pair. A format that cannot be written is taken
// for one file.
std::vector<std::string> FilesOfMeshWritten(const std::string& path, const std::string& format);

// Tells early whether WriteMesh would refuse `path` and `format` for a mesh of `dimension` (0: not known yet) that may
// have weights, as far as that can be known without writing.
absl::Status CheckMeshOutput(const std::string& path, const std::string& format, int dimension = 0,
                             bool may_have_weights = false, MeshOrder order = MeshOrder::kFirst);

// Writes a mesh piece by piece, so that it need not fit into memory.
//
// Memory: a few blocks for a regular file; for vtu into a pipe or a device the compressed array that is being written;
//         with periodic axes, for msh and npz, what PeriodicPairs says; for node with weights or tags of vertices the
//         points, for msh41 and msh22 with weights these. With several regions, for msh41, msh22, medit and node also
//         16 bytes for each run of simplices of one region; for msh41 into a pipe or a device the simplices, and
//         otherwise 4 KiB a region. For vtk all data of vertices; for abaqus the points, the facets, and the simplices
//         that may have one. Of second order the mesh, and for the edges 24 bytes a tetrahedron or 12 a triangle, and 8
//         a vertex: the file appears with Commit alone.
// Thread safety: thread-compatible.
class MeshWriter {
 public:
  virtual ~MeshWriter() = default;
  MeshWriter(const MeshWriter&) = delete;
  MeshWriter& operator=(const MeshWriter&) = delete;

  // The next rows of the arrays: all points, then all weights if the shape has them, then all origins and all tags of
  // vertices if it has marks, then each of its attributes. All regions of simplices follow, if it has them, then all
  // simplices, all facets of its boundary, and all ridges. Returns the first error of all so far.
  // REQUIRES:   whole rows, no more than the shape says, nothing of an array before another that goes first.
  virtual absl::Status AddPoints(std::span<const double> points) = 0;
  virtual absl::Status AddWeights(std::span<const double> weights) = 0;
  virtual absl::Status AddVertexOrigins(std::span<const uint32_t> /*origins*/) { return absl::OkStatus(); }
  virtual absl::Status AddVertexTags(std::span<const int32_t> /*tags*/) { return absl::OkStatus(); }
  // The next vertices' values of the attribute `index` of the shape; ignored by formats without a place for attributes.
  virtual absl::Status AddAttribute(size_t /*index*/, std::span<const double> /*values*/) { return absl::OkStatus(); }
  virtual absl::Status AddSimplexRegions(std::span<const int32_t> regions) = 0;
  virtual absl::Status AddSimplices(std::span<const uint32_t> simplices) = 0;
  virtual absl::Status AddFacets(std::span<const uint32_t> facets) = 0;
  // Ignored by formats without a place for ridges.
  virtual absl::Status AddRidges(std::span<const uint32_t> /*ridges*/) { return absl::OkStatus(); }

  // Gives the file its name. Without it, no file is left or changed.
  // Errors:     the first of all so far; INTERNAL when rows are missing.
  virtual absl::Status Commit() = 0;

  // The parts of the mesh that the file holds otherwise than they came, or not at all, a sentence each; all of it after
  // Commit.
  const std::vector<std::string>& notes() const { return notes_; }
  // An empty one is none.
  void AddNote(std::string note) {
    if (!note.empty()) {
      notes_.push_back(std::move(note));
    }
  }

 protected:
  MeshWriter() = default;

 private:
  std::vector<std::string> notes_;
};

// A writer to `path`; "-" is standard output. `format` empty: by the extension; standard output is vtu. Ends with
// CANCELLED once `stop` asks for it.
//
// Errors:     as of WriteMesh.
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMesh(const std::string& path, const std::string& format,
                                                       const MeshShape& shape, std::stop_token stop = {});

// Writes `mesh` to `path`; "-" is standard output. `format` empty: by the extension; standard output is vtu. `notes`,
// unless it is null, gets those of the writer.
//
// Guarantees: coordinates read back to the bit, but for abaqus; on an error, or when `stop` ends it with CANCELLED, no
//             file is left or changed.
// Errors:     INVALID_ARGUMENT for an unknown format, or one that cannot hold this mesh or go there; of writing, naming
//             the file.
absl::Status WriteMesh(const std::string& path, const std::string& format, const MeshView& mesh,
                       std::stop_token stop = {}, std::vector<std::string>* notes = nullptr);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_WRITE_MESH_H_
