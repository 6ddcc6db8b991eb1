// The products of a mesher: meshes, estimates of them, Voronoi cells.
#ifndef WELLSPACE_CORE_MESH_MESH_H_
#define WELLSPACE_CORE_MESH_MESH_H_

#include <cstdint>
#include <vector>

#include "core/base/memory/huge_pages.h"
#include "core/mesh/mesh_statistics.h"
#include "core/simplex/boundary.h"

namespace wellspace::core {

// Where a vertex comes from, if it is no input point.
inline constexpr uint32_t kSteinerOrigin = 0xffff'ffff;  // the refinement
inline constexpr uint32_t kRepairOrigin = 0xffff'fffe;   // the repair of slivers
inline constexpr uint32_t kCornerOrigin = 0xffff'fffd;   // it is a corner of the box

// The vertex of an input point that is not meshed: it lies in a hole, or outside of all that segments enclose.
inline constexpr uint32_t kNoOutput = 0xffff'ffff;

struct Mesh {
  int dimension = 0;
  std::vector<double> domain_low;   // dimension
  std::vector<double> domain_high;  // dimension
  // vertex_count x dimension, row-major. The distinct input points come first, in the order of their first appearance
  // and with their bits unchanged; then the corners of the box that are not input points; then the others in the order
  // in which they were inserted: Steiner vertices and points added later.
  HugeVector<double> points;
  // simplex_count x (dimension + 1) indices of vertices, row-major; each simplex positively oriented, its lowest vertex
  // first.
  HugeVector<uint32_t> simplices;
  // The vertex that each input point became; then the vertices of the points added later, in the order of adding.
  HugeVector<uint32_t> input_vertex;
  // The weight of each vertex, a squared length; the mesh is their regular triangulation. Empty where all are zero, and
  // the mesh is Delaunay.
  HugeVector<double> weights;
  // Vertices of the mesh that was extracted before which are elsewhere now, ascending; none in a first mesh. They are
  // Steiner vertices: neither input points nor corners of the box.
  HugeVector<uint32_t> moved_vertices;
  // For each vertex the number of the first input point that became it, in the order of input_vertex; else one of the
  // origins above.
  HugeVector<uint32_t> vertex_origins;
  // For each vertex the least tag of a part of the boundary that it is on, or kNoTag.
  HugeVector<int32_t> vertex_tags;
  // The boundary: facet_count x dimension indices of vertices, row-major, part after part as `boundary` has them;
  // oriented and ordered as FindBoxBoundary says.
  HugeVector<uint32_t> facets;
  std::vector<BoundaryPart> boundary;
  // The edges on curves of a surface: rows of 2 indices of vertices, curve after curve, along each. None elsewhere.
  HugeVector<uint32_t> ridges;
  // The region of each simplex, as an id of `regions`. Empty: all are of the only region.
  HugeVector<int32_t> simplex_regions;
  std::vector<Region> regions;
  MeshStatistics statistics;

  uint64_t facet_count() const { return dimension == 0 ? 0 : facets.size() / dimension; }
  uint64_t vertex_count() const { return dimension == 0 ? 0 : points.size() / dimension; }
  uint64_t simplex_count() const { return dimension == 0 ? 0 : simplices.size() / (dimension + 1); }
};

// The size of a mesh, predicted from the tree over its points. A figure of 2^53 stands for that or
// more.
struct MeshEstimate {
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  uint64_t memory_bytes = 0;  // peak, of the meshing itself
  uint64_t tree_leaves = 0;
  double bytes_per_vertex = 0;  // of the peak, whatever the figures above stand for
};

// A clipped Voronoi cell, as [HT08] Definition 2 has it but with a cube in the place of the ball.
struct Cell {
  uint32_t vertex = 0;
  double clip_radius = 0;  // half the side of the cube about the vertex; the cell is also clipped by the box
  // node_count x dimension, row-major; in 2-D counterclockwise around the cell, above ascending by coordinates.
  std::vector<double> nodes;
  std::vector<uint32_t> neighbours;  // the vertices whose bisectors with `vertex` bound the cell, ascending
  bool is_clipped = false;           // it reaches the cube; if not, it is the whole Voronoi cell in the box
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_MESH_H_
