// Simplices of meshes that are seen through their arrays.
#ifndef WELLSPACE_CORE_MESH_VIEW_ROWS_H_
#define WELLSPACE_CORE_MESH_VIEW_ROWS_H_

#include <algorithm>
#include <cstddef>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
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

// Makes `numbers` so many times `value`, a block at a time.
//
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <typename Numbers>
absl::Status Fill(Numbers& numbers, size_t count, double value, const RunContext& context) {
  constexpr size_t kBlock = size_t{1} << 20;
  numbers.clear();
  numbers.reserve(count);
  while (numbers.size() < count) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    numbers.resize(std::min(count, numbers.size() + kBlock), value);
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_VIEW_ROWS_H_
