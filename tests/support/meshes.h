// Small meshes that are known to be right, for the tests of what checks and measures meshes.
#ifndef WELLSPACE_TESTS_SUPPORT_MESHES_H_
#define WELLSPACE_TESTS_SUPPORT_MESHES_H_

#include <cstdint>
#include <vector>

#include "core/simplex/validate.h"

namespace wellspace::test {

struct TestMesh {
  int dimension = 0;
  std::vector<double> points;
  std::vector<uint32_t> simplices;

  core::MeshView View() const { return {dimension, points, simplices}; }
  size_t VertexCount() const { return points.size() / static_cast<size_t>(dimension); }
  size_t SimplexCount() const { return simplices.size() / static_cast<size_t>(dimension + 1); }
  double* Vertex(size_t v) { return &points[v * static_cast<size_t>(dimension)]; }
  uint32_t* Corners(size_t simplex) { return &simplices[simplex * static_cast<size_t>(dimension + 1)]; }
};

// cells^dimension cubes, each cut into dimension! simplices around a main diagonal (Kuhn), with corners low + spacing *
// (i, j, k), vertex (i * (cells + 1) + j) * (cells + 1) + k. Every cell is cospherical, so this is a Delaunay
// triangulation when the coordinates are exact.
TestMesh KuhnGrid(int dimension, uint32_t cells, double low = 0, double spacing = 1);

// The unit box as a cone from `apex` (D coordinates, inside) over its triangulated boundary. The apex is vertex
// 2^dimension.
TestMesh ConeOverUnitBox(const std::vector<double>& apex);

// The two ways to triangulate D + 2 points in convex position.
struct BothTriangulations {
  TestMesh first;
  TestMesh second;
};
// Quadrilateral a b c d, convex, counter-clockwise: diagonal a c, diagonal b d.
BothTriangulations Quadrilateral(const std::vector<double>& abcd);
// Bipyramid with triangle a b c and apexes d above and e below: two tetrahedra at a b c, three around d e.
BothTriangulations Bipyramid(const std::vector<double>& abcde);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_MESHES_H_
