// Simplices of meshes that are seen through their arrays.
#ifndef WELLSPACE_CORE_MESH_VIEW_ROWS_H_
#define WELLSPACE_CORE_MESH_VIEW_ROWS_H_

#include <cstddef>

#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/validate/validate.h"

namespace wellspace::core {

template <int D>
Simplex<D> CornersOf(const MeshView& mesh, size_t simplex) {
  Simplex<D> corners;
  for (int i = 0; i <= D; ++i) {
    corners[i] = PointAt<D>(mesh.points, mesh.simplices[simplex * (D + 1) + i]);
  }
  return corners;
}

// The centroid. No sum on the way is beyond the range of doubles.
template <int D>
Point<D> CentroidOf(const Simplex<D>& corners) {
  Point<D> centroid{};
  for (const Point<D>& corner : corners) {
    for (int axis = 0; axis < D; ++axis) {
      centroid[axis] += corner[axis] / (D + 1);
    }
  }
  return centroid;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_VIEW_ROWS_H_
