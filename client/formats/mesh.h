// A mesh as files hold it.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_H_

#include <cstdint>
#include <span>
#include <vector>

namespace wellspace::formats {

// "triangles", "tetrahedra" or, in higher dimensions, "simplices".
inline const char* SimplexName(int dimension) {
  return dimension == 2 ? "triangles" : dimension == 3 ? "tetrahedra" : "simplices";
}

// How large the arrays of a mesh are.
struct MeshShape {
  int dimension = 0;
  uint64_t vertex_count = 0;
  uint64_t simplex_count = 0;
  uint64_t input_vertices = 0;  // so many of the first vertices are input points; the others were added
  bool has_weights = false;
};

// Simplices: triangles in 2-D, tetrahedra in 3-D.
struct MeshView {
  int dimension = 0;
  std::span<const double> points;       // vertex_count x dimension, row-major
  std::span<const uint32_t> simplices;  // simplex_count x (dimension + 1), row-major
  uint64_t input_vertices = 0;          // see MeshShape
  std::span<const double> weights{};    // vertex_count squared lengths of a regular triangulation, or empty

  uint64_t vertex_count() const { return dimension == 0 ? 0 : points.size() / dimension; }
  uint64_t simplex_count() const { return dimension == 0 ? 0 : simplices.size() / (dimension + 1); }
  MeshShape Shape() const {
    return {.dimension = dimension,
            .vertex_count = vertex_count(),
            .simplex_count = simplex_count(),
            .input_vertices = input_vertices,
            .has_weights = !weights.empty()};
  }
};

struct Mesh {
  int dimension = 0;
  std::vector<double> points;
  std::vector<uint32_t> simplices;
  std::vector<double> weights{};  // see MeshView

  MeshView View() const {
    return {.dimension = dimension, .points = points, .simplices = simplices, .weights = weights};
  }
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_H_
