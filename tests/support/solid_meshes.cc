#include "tests/support/solid_meshes.h"

#include <algorithm>
#include <utility>

#include "core/base/run_context.h"
#include "core/geometry/vector_product.h"

namespace wellspace::test {

core::Simplex<3> Tetrahedra::At(size_t tetrahedron) const {
  core::Simplex<3> corners;
  for (size_t k = 0; k < 4; ++k) {
    corners[k] = core::PointAt<3>(points, simplices[4 * tetrahedron + k]);
  }
  return corners;
}

double Tetrahedra::VolumeOf(size_t tetrahedron) const {
  const core::Simplex<3> s = At(tetrahedron);
  return core::Dot<3>(core::Difference<3>(s[1], s[0]),
                      core::Cross(core::Difference<3>(s[2], s[0]), core::Difference<3>(s[3], s[0]))) /
         6;
}

Tetrahedra GridMesh(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z) {
  Tetrahedra mesh;
  for (const double at_x : x) {
    for (const double at_y : y) {
      for (const double at_z : z) {
        mesh.points.insert(mesh.points.end(), {at_x, at_y, at_z});
      }
    }
  }
  const auto row = static_cast<uint32_t>(z.size());
  const uint32_t layer = row * static_cast<uint32_t>(y.size());
  const std::array<uint32_t, 3> steps = {layer, row, 1};
  for (uint32_t i = 0; i + 1 < x.size(); ++i) {
    for (uint32_t j = 0; j + 1 < y.size(); ++j) {
      for (uint32_t k = 0; k + 1 < z.size(); ++k) {
        std::array<uint32_t, 3> order = {0, 1, 2};
        do {
          const uint32_t first = i * layer + j * row + k;
          std::array<uint32_t, 4> corners = {first, first + steps[order[0]], first + steps[order[0]] + steps[order[1]],
                                             first + layer + row + 1};
          if ((order[0] + 1) % 3 != order[1]) {
            std::swap(corners[1], corners[2]);
          }
          mesh.simplices.insert(mesh.simplices.end(), corners.begin(), corners.end());
        } while (std::next_permutation(order.begin(), order.end()));
      }
    }
  }
  return mesh;
}

std::vector<double> GridAround(const TestSurface& surface, int axis) {
  std::vector<double> grid;
  for (size_t i = axis; i < surface.points.size(); i += 3) {
    grid.push_back(surface.points[i]);
  }
  std::sort(grid.begin(), grid.end());
  grid.erase(std::unique(grid.begin(), grid.end()), grid.end());
  const double size = grid.back() - grid.front();
  grid.insert(grid.begin(), grid.front() - 0.5 * size);
  grid.push_back(grid.back() + 0.5 * size);
  return grid;
}

Tetrahedra GridMeshAround(const TestSurface& surface) {
  return GridMesh(GridAround(surface, 0), GridAround(surface, 1), GridAround(surface, 2));
}

std::unique_ptr<IndexedSurface> IndexOf(const TestSurface& surface) {
  const core::RunContext context;
  auto indexed = std::make_unique<IndexedSurface>();
  indexed->complex = *core::MakeSurfaceComplex(surface.points, {}, surface.Features(), context);
  indexed->solids = *core::FindSolids(indexed->complex, context);
  core::Box<3> box;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> grid = GridAround(surface, axis);
    box.low[axis] = grid.front();
    box.high[axis] = grid.back();
  }
  const absl::Status built = indexed->index.Build(indexed->complex, indexed->solids, core::MortonGrid<3>(box), context);
  return built.ok() ? std::move(indexed) : nullptr;
}

int VoxelPart::MaterialAt(int i, int j, int k) const {
  const std::array<size_t, 3> count = {grid[0].size() - 1, grid[1].size() - 1, grid[2].size() - 1};
  return materials[(static_cast<size_t>(i) * count[1] + static_cast<size_t>(j)) * count[2] + static_cast<size_t>(k)];
}

TestSurface VoxelPart::Surface() const {
  return Boxes(grid[0], grid[1], grid[2], [this](int i, int j, int k) { return MaterialAt(i, j, k); });
}

double VoxelPart::VolumeOf(int material) const {
  double volume = 0;
  for (int i = 0; i + 1 < static_cast<int>(grid[0].size()); ++i) {
    for (int j = 0; j + 1 < static_cast<int>(grid[1].size()); ++j) {
      for (int k = 0; k + 1 < static_cast<int>(grid[2].size()); ++k) {
        if (MaterialAt(i, j, k) == material) {
          volume += (grid[0][i + 1] - grid[0][i]) * (grid[1][j + 1] - grid[1][j]) * (grid[2][k + 1] - grid[2][k]);
        }
      }
    }
  }
  return volume;
}

VoxelPart RandomVoxelPart(int boxes, int materials, SplitMix64& random) {
  VoxelPart part;
  for (std::vector<double>& along : part.grid) {
    double at = 0;
    for (int i = 0; i <= boxes; ++i) {
      along.push_back(at);
      at += 0.25 * static_cast<double>(1 + random.Below(6));
    }
  }
  bool has_any = false;
  for (int i = 0; i < boxes * boxes * boxes; ++i) {
    const auto material = static_cast<int>(random.Below(static_cast<uint64_t>(materials) + 1));
    has_any = has_any || material != 0;
    part.materials.push_back(material);
  }
  part.materials[0] = has_any ? part.materials[0] : 1;
  return part;
}

}  // namespace wellspace::test
