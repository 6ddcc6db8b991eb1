// Small meshes that are known to be right, for the tests of code that checks and measures meshes.
#ifndef WELLSPACE_TESTS_SUPPORT_MESHES_H_
#define WELLSPACE_TESTS_SUPPORT_MESHES_H_

#include <cstdint>
#include <vector>

#include "core/validate/validate.h"

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

// KuhnGrid with the lines of the grid at `lines`, the same on every axis. Cells are boxes, hence cospherical: Delaunay
// again when the coordinates are exact.
TestMesh KuhnGridOn(int dimension, const std::vector<double>& lines);

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

// In any dimension: D corners of a facet and an apex at a distance of `height` on either side of it; two simplices at
// the facet, D around the line between the apexes. The facet's corners are at a distance of 1 to its middle, so the
// first is Delaunay for height > 1 only, the second for height < 1 only.
BothTriangulations TwoApexes(int dimension, double height);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_MESHES_H_
