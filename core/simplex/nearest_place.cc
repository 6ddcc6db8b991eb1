#include "core/simplex/nearest_place.h"

#include <cstddef>
#include <limits>

#include "core/base/dimensions.h"
#include "core/simplex/determinant.h"

namespace wellspace::core {
namespace {

// Solves the normal equations of the first `size` edges by elimination; they are positive definite. False: the edges
// depend on each other, to rounding.
template <int D>
bool Solve(std::array<std::array<double, D>, D>& gram, std::array<double, D>& sums, int size) {
  for (int k = 0; k < size; ++k) {
    if (!(gram[k][k] > 0)) {
      return false;
    }
    for (int row = k + 1; row < size; ++row) {
      const double factor = gram[row][k] / gram[k][k];
      for (int column = k; column < size; ++column) {
        gram[row][column] -= factor * gram[k][column];
      }
      sums[row] -= factor * sums[k];
    }
  }
  for (int k = size - 1; k >= 0; --k) {
    for (int column = k + 1; column < size; ++column) {
      sums[k] -= gram[k][column] * sums[column];
    }
    sums[k] /= gram[k][k];
  }
  return true;
}

// The foot of the perpendicular from the origin to the face of the corners in `mask`, if it is in the face.
template <int D>
bool FootIn(const Simplex<D>& corners, unsigned mask, NearestPlace<D>* place) {
  std::array<int, D + 1> of_face;
  int count = 0;
  for (int i = 0; i <= D; ++i) {
    if ((mask >> i) & 1) {
      of_face[count++] = i;
    }
  }
  const Point<D>& first = corners[of_face[0]];
  std::array<Point<D>, D> edges;
  std::array<std::array<double, D>, D> gram;
  std::array<double, D> parts;
  for (int k = 0; k + 1 < count; ++k) {
    edges[k] = Difference<D>(corners[of_face[k + 1]], first);
    parts[k] = -Dot<D>(edges[k], first);
    for (int other = 0; other <= k; ++other) {
      gram[k][other] = gram[other][k] = Dot<D>(edges[k], edges[other]);
    }
  }
  if (!Solve<D>(gram, parts, count - 1)) {
    return false;
  }
  double left = 1;
  Point<D> foot = first;
  *place = {};
  for (int k = 0; k + 1 < count; ++k) {
    if (!(parts[k] >= 0)) {
      return false;
    }
    left -= parts[k];
    place->coordinates[of_face[k + 1]] = parts[k];
    for (int axis = 0; axis < D; ++axis) {
      foot[axis] += parts[k] * edges[k][axis];
    }
  }
  place->coordinates[of_face[0]] = left;
  place->distance_sq = NormSq<D>(foot);
  return left >= 0;
}

}  // namespace

template <int D>
NearestPlace<D> NearestIn(const Simplex<D>& corners, const Point<D>& x, double scale) {
  Simplex<D> from_x;
  Differences<D>(corners, x, scale, &from_x);
  NearestPlace<D> nearest{.distance_sq = std::numeric_limits<double>::infinity()};
  constexpr unsigned kAll = (1u << (D + 1)) - 1;
  for (unsigned mask = 1; mask < kAll; ++mask) {
    NearestPlace<D> place;
    if (FootIn<D>(from_x, mask, &place) && place.distance_sq < nearest.distance_sq) {
      nearest = place;
    }
  }
  return nearest;
}

#define WELLSPACE_INSTANTIATE(D) template NearestPlace<D> NearestIn<D>(const Simplex<D>&, const Point<D>&, double);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
