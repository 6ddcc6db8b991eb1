// Boxes and grids for trees: cubes and others, about the origin and far from it.
#ifndef WELLSPACE_TESTS_CORE_TREE_TREE_BOXES_H_
#define WELLSPACE_TESTS_CORE_TREE_TREE_BOXES_H_

#include <cstddef>
#include <set>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/tree/morton.h"

namespace wellspace::core {

template <int D>
Box<D> MakeBox(double low, const Point<D>& sides) {
  Box<D> box;
  for (int k = 0; k < D; ++k) {
    box.low[k] = low;
    box.high[k] = low + sides[k];
  }
  return box;
}

template <int D>
std::vector<Box<D>> Boxes() {
  Point<D> cube;
  cube.fill(1);
  Point<D> odd = cube;
  odd[0] = 0.7;
  odd[D - 1] = 1.3;
  Point<D> elongated;
  elongated.fill(1e-3);
  elongated[0] = 1;
  Point<D> exact = cube;
  exact[D - 1] = 0x1p-3;
  std::vector<Box<D>> boxes = {MakeBox<D>(0, cube), MakeBox<D>(-0.3, odd), MakeBox<D>(1e6, cube)};
  if (D <= 4) {  // cubes as small as the shortest side are too many for looks at all pairs
    boxes.push_back(MakeBox<D>(12.3, elongated));
    boxes.push_back(MakeBox<D>(-1, exact));
  }
  return boxes;
}

// Grids under these boxes, with all roots that a tree may have over them.
template <int D>
std::vector<MortonGrid<D>> Grids() {
  std::vector<MortonGrid<D>> grids;
  for (const Box<D>& box : Boxes<D>()) {
    std::set<double> roots;
    for (size_t count = 0; count < 64; ++count) {
      const MortonGrid<D> grid(box, count);
      if (roots.insert(grid.root_side()).second) {
        grids.push_back(grid);
      }
    }
  }
  return grids;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_TESTS_CORE_TREE_TREE_BOXES_H_
