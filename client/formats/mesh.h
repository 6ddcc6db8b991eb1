// A mesh as files hold it.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_H_

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/formats/attributes.h"
#include "client/formats/mesh_order.h"
#include "client/formats/mesh_part.h"

namespace wellspace::formats {

class MiddleNodes;

// "triangles", "tetrahedra" or, in higher dimensions, "simplices".
inline const char* SimplexName(int dimension) {
  return dimension == 2 ? "triangles" : dimension == 3 ? "tetrahedra" : "simplices";
}

// Where a vertex comes from, if it is no input point.
inline constexpr uint32_t kSteinerOrigin = 0xffff'ffff;  // the refinement
inline constexpr uint32_t kRepairOrigin = 0xffff'fffe;   // the repair of slivers
inline constexpr uint32_t kCornerOrigin = 0xffff'fffd;   // it is a corner of the box
inline constexpr uint32_t kMiddleOrigin = 0xffff'fffc;   // it is the middle of an edge, in a file of second order

// An origin as files have it: -1, -2, -3 and -4 in the place of these four.
constexpr int64_t SignedOrigin(uint32_t origin) {
  return origin >= kMiddleOrigin ? int64_t{origin} - (int64_t{1} << 32) : int64_t{origin};
}

// Facets of the boundary with a tag in common.
struct BoundaryPart {
  int32_t tag = 0;
  std::string name;  // empty: not known
  uint64_t facets = 0;

  bool operator==(const BoundaryPart&) const = default;
};

// Simplices of one material.
struct Region {
  int32_t id = 0;
  std::string name;

  bool operator==(const Region&) const = default;
};

// How many facets the parts have.
inline uint64_t CountFacets(std::span<const BoundaryPart> parts) {
  uint64_t count = 0;
  for (const BoundaryPart& part : parts) {
    count += part.facets;
  }
  return count;
}

// The sizes of the arrays of a mesh. Rows that come to a writer are those of first order, whatever the order.
struct MeshShape {
  int dimension = 0;
  uint64_t vertex_count = 0;
  uint64_t simplex_count = 0;
  uint64_t input_vertices = 0;  // so many of the first vertices are input points; the others were added
  bool has_weights = false;
  bool has_vertex_marks = false;         // each vertex has an origin and a tag
  std::vector<BoundaryPart> boundary{};  // in the order of their facets; empty: nothing is told of the boundary
  bool has_simplex_regions = false;      // if not, all simplices are of the only region
  std::vector<Region> regions{};         // empty: nothing is told of regions
  std::vector<double> low{};             // of the mesh's box; may be missing where there is no boundary
  std::vector<double> high{};
  std::vector<int> periodic_axes{};       // ascending: vertices across them are pairs; with a box, up to 3-D
  uint64_t ridge_count = 0;               // edges along the creases of a surface
  std::vector<std::string> attributes{};  // of vertices: names as of NamesToWrite
  const PartNumbers* part = nullptr;      // of a part of a larger mesh; outlives the writer; null: it is whole
  MeshOrder order = MeshOrder::kFirst;    // of elements of the file; kSecond: in 2-D and 3-D
  // For writers of formats alone, whose rows of second order have all nodes, those at the middles of edges behind the
  // vertices; outlives the writer.
  const MiddleNodes* middles = nullptr;

  uint64_t facet_count() const { return CountFacets(boundary); }
  int simplex_nodes() const { return NodesOf(dimension + 1, order); }
  int facet_nodes() const { return NodesOf(dimension, order); }
};

// Simplices: triangles in 2-D, tetrahedra in 3-D.
struct MeshView {
  int dimension = 0;
  std::span<const double> points;       // vertex_count x dimension, row-major
  std::span<const uint32_t> simplices;  // simplex_count x (dimension + 1), row-major
  uint64_t input_vertices = 0;          // see MeshShape
  std::span<const double> weights{};    // vertex_count squared lengths of a regular triangulation, or empty
  // The following are known together, or not.
  std::span<const uint32_t> vertex_origins{};  // vertex_count numbers of input points, or origins as above
  std::span<const int32_t> vertex_tags{};      // vertex_count; 0: inside
  std::span<const uint32_t> facets{};          // facet_count x dimension, part after part
  std::span<const BoundaryPart> boundary{};
  std::span<const uint32_t> ridges{};          // ridge_count x 2: edges of facets along creases, in 3-D; or none
  std::span<const int32_t> simplex_regions{};  // simplex_count ids; empty: all are of the only region
  std::span<const Region> regions{};
  std::span<const int> periodic_axes{};             // see MeshShape
  std::span<const Attribute> attributes{};          // of vertices
  std::span<const Attribute> simplex_attributes{};  // for pictures alone: writers of meshes leave them out
  const PartNumbers* part = nullptr;                // see MeshShape
  MeshOrder order = MeshOrder::kFirst;              // see MeshShape

  uint64_t vertex_count() const { return dimension == 0 ? 0 : points.size() / dimension; }
  uint64_t simplex_count() const { return dimension == 0 ? 0 : simplices.size() / (dimension + 1); }
  MeshShape Shape() const {
    MeshShape shape{.dimension = dimension,
                    .vertex_count = vertex_count(),
                    .simplex_count = simplex_count(),
                    .input_vertices = input_vertices,
                    .has_weights = !weights.empty(),
                    .has_vertex_marks = !vertex_tags.empty(),
                    .boundary = {boundary.begin(), boundary.end()},
                    .has_simplex_regions = !simplex_regions.empty(),
                    .regions = {regions.begin(), regions.end()},
                    .periodic_axes = {periodic_axes.begin(), periodic_axes.end()},
                    .ridge_count = ridges.size() / 2,
                    .attributes = NamesToWrite(attributes),
                    .part = part,
                    .order = order};
    const bool has_box = !boundary.empty() || !periodic_axes.empty();
    for (size_t i = 0; i < points.size() && has_box; ++i) {
      const size_t axis = i % dimension;
      if (i < static_cast<size_t>(dimension)) {
        shape.low.push_back(points[i]);
        shape.high.push_back(points[i]);
      }
      shape.low[axis] = std::min(shape.low[axis], points[i]);
      shape.high[axis] = std::max(shape.high[axis], points[i]);
    }
    return shape;
  }
};

struct Mesh {
  int dimension = 0;
  std::vector<double> points;
  std::vector<uint32_t> simplices;
  std::vector<double> weights{};  // see MeshView; also for the following
  std::vector<double> numbers{};  // of the vertices, by the name that a reader was given; else empty
  std::vector<uint32_t> vertex_origins{};
  std::vector<int32_t> vertex_tags{};
  std::vector<uint32_t> facets{};
  std::vector<BoundaryPart> boundary{};
  std::vector<uint32_t> ridges{};
  std::vector<int32_t> simplex_regions{};
  std::vector<Region> regions{};
  std::vector<Attribute> simplex_attributes{};  // if they were asked for: of VTK's formats, the data of cells
  std::vector<std::string> notes{};             // parts of its file that were left out, a sentence each

  MeshView View() const {
    return {.dimension = dimension,
            .points = points,
            .simplices = simplices,
            .weights = weights,
            .vertex_origins = vertex_origins,
            .vertex_tags = vertex_tags,
            .facets = facets,
            .boundary = boundary,
            .ridges = ridges,
            .simplex_regions = simplex_regions,
            .regions = regions,
            .simplex_attributes = simplex_attributes};
  }
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_H_
