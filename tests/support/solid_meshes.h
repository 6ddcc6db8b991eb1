// Meshes in space, with or without the facets of a surface, and surfaces with their index.
#ifndef WELLSPACE_TESTS_SUPPORT_SOLID_MESHES_H_
#define WELLSPACE_TESTS_SUPPORT_SOLID_MESHES_H_

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/tree/surface_index.h"
#include "tests/support/surfaces.h"

namespace wellspace::test {

struct Tetrahedra {
  std::vector<double> points;       // n x 3
  std::vector<uint32_t> simplices;  // m x 4, positively oriented

  core::Simplex<3> At(size_t tetrahedron) const;
  double VolumeOf(size_t tetrahedron) const;
};

// A grid of boxes between these coordinates, of which each is six tetrahedra around its diagonal. All of them have the
// middle of the box for their circumcentre. Ends of the arrays ascend.
Tetrahedra GridMesh(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z);

// The coordinates of a surface's points along an axis, each once, and one more beyond both ends.
std::vector<double> GridAround(const TestSurface& surface, int axis);

// The mesh of the grid through all points of a surface: of one whose triangles lie in planes across the axes it has the
// facets.
Tetrahedra GridMeshAround(const TestSurface& surface);

// In place, since the index has addresses of the rest.
struct IndexedSurface {
  core::SurfaceComplex complex;
  core::Solids solids;
  core::SurfaceIndex index;
};

// The index of a surface in the box around it, which is wider by its own size.
std::unique_ptr<IndexedSurface> IndexOf(const TestSurface& surface);

// An axis-aligned part, of which each box of a grid is of a material or of none, by chance.
struct VoxelPart {
  std::array<std::vector<double>, 3> grid;
  std::vector<int> materials;  // by box, along the last axis first

  int MaterialAt(int i, int j, int k) const;
  TestSurface Surface() const;
  // The sum of the boxes of a material.
  double VolumeOf(int material) const;
};

VoxelPart RandomVoxelPart(int boxes, int materials, SplitMix64& random);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_SOLID_MESHES_H_
