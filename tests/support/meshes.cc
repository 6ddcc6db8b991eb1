#include "tests/support/meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace wellspace::test {
namespace {

bool IsOdd(const std::vector<int>& permutation) {
  int inversions = 0;
  for (size_t i = 0; i < permutation.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      inversions += permutation[j] > permutation[i] ? 1 : 0;
    }
  }
  return inversions % 2 == 1;
}

}  // namespace

TestMesh KuhnGrid(int dimension, uint32_t cells, double low, double spacing) {
  const size_t d = static_cast<size_t>(dimension);
  TestMesh mesh{.dimension = dimension, .points = {}, .simplices = {}};
  // The step in vertex numbers along each axis; the last axis is the fastest.
  std::vector<uint32_t> stride(d, 1);
  for (size_t k = d - 1; k > 0; --k) {
    stride[k - 1] = stride[k] * (cells + 1);
  }
  const uint32_t vertices = stride[0] * (cells + 1);
  for (uint32_t v = 0; v < vertices; ++v) {
    bool is_low_corner = true;
    for (size_t k = 0; k < d; ++k) {
      const uint32_t i = v / stride[k] % (cells + 1);
      mesh.points.push_back(low + spacing * i);
      is_low_corner = is_low_corner && i < cells;
    }
    if (!is_low_corner) {
      continue;
    }
    std::vector<int> axes(d);
    std::iota(axes.begin(), axes.end(), 0);
    do {
      std::vector<uint32_t> corners = {v};
      for (const int axis : axes) {
        corners.push_back(corners.back() + stride[static_cast<size_t>(axis)]);
      }
      if (IsOdd(axes)) {
        std::swap(corners[d - 1], corners[d]);
      }
      mesh.simplices.insert(mesh.simplices.end(), corners.begin(), corners.end());
    } while (std::next_permutation(axes.begin(), axes.end()));
  }
  return mesh;
}

TestMesh KuhnGridOn(int dimension, const std::vector<double>& lines) {
  TestMesh mesh = KuhnGrid(dimension, static_cast<uint32_t>(lines.size()) - 1);
  for (double& x : mesh.points) {
    x = lines[static_cast<size_t>(x)];
  }
  return mesh;
}

TestMesh ConeOverUnitBox(const std::vector<double>& apex) {
  const int d = static_cast<int>(apex.size());
  TestMesh cube = KuhnGrid(d, 1);
  TestMesh cone{.dimension = d, .points = cube.points, .simplices = {}};
  const auto apex_index = static_cast<uint32_t>(cube.VertexCount());
  cone.points.insert(cone.points.end(), apex.begin(), apex.end());
  for (size_t s = 0; s < cube.SimplexCount(); ++s) {
    for (int skip = 0; skip <= d; ++skip) {
      // Bits of the vertices' numbers are their coordinates: a facet is on a face where a bit is common to all.
      uint32_t all = ~0u;
      uint32_t any = 0;
      std::vector<uint32_t> corners(cube.Corners(s), cube.Corners(s) + d + 1);
      for (int i = 0; i <= d; ++i) {
        if (i != skip) {
          all &= corners[static_cast<size_t>(i)];
          any |= corners[static_cast<size_t>(i)];
        }
      }
      if (all != 0 || any != (1u << d) - 1) {
        corners[static_cast<size_t>(skip)] = apex_index;
        cone.simplices.insert(cone.simplices.end(), corners.begin(), corners.end());
      }
    }
  }
  return cone;
}

BothTriangulations Quadrilateral(const std::vector<double>& abcd) {
  return {{2, abcd, {0, 1, 2, 0, 2, 3}}, {2, abcd, {0, 1, 3, 1, 2, 3}}};
}

BothTriangulations Bipyramid(const std::vector<double>& abcde) {
  return {{3, abcde, {0, 1, 2, 3, 0, 2, 1, 4}}, {3, abcde, {0, 1, 4, 3, 1, 2, 4, 3, 2, 0, 4, 3}}};
}

BothTriangulations TwoApexes(int dimension, double height) {
  const size_t d = static_cast<size_t>(dimension);
  const auto corners = static_cast<uint32_t>(d);  // of the facet: 0 to d - 1; then the apexes
  // A regular simplex in d - 1 coordinates: its corners minus their mean.
  std::vector<double> points((d + 2) * d, 0.0);
  const double last = d == 2 ? -1 : (1 - std::sqrt(static_cast<double>(d))) / static_cast<double>(d - 1);
  for (size_t i = 0; i < d; ++i) {
    double norm_sq = 0;
    for (size_t k = 0; k + 1 < d; ++k) {
      const double mean = d == 2 ? 0 : (1 + last) / static_cast<double>(d);
      points[i * d + k] = (i + 1 == d ? last : i == k ? 1 : 0) - mean;
      norm_sq += points[i * d + k] * points[i * d + k];
    }
    for (size_t k = 0; k + 1 < d; ++k) {
      points[i * d + k] /= std::sqrt(norm_sq);
    }
  }
  points[d * d + d - 1] = height;
  points[(d + 1) * d + d - 1] = -height;
  BothTriangulations both = {{dimension, points, {}}, {dimension, points, {}}};
  const auto append = [](TestMesh& mesh, std::vector<uint32_t> simplex, bool negative) {
    if (negative) {
      std::swap(simplex[0], simplex[1]);
    }
    mesh.simplices.insert(mesh.simplices.end(), simplex.begin(), simplex.end());
  };
  // The orientation of the facet and the upper apex, by the one of them that is positive; all others follow from it.
  std::vector<uint32_t> upper(d + 1);
  std::iota(upper.begin(), upper.end(), 0);
  TestMesh probe{dimension, points, upper};
  const bool negative = !core::ValidateOrientation(probe.View()).ok();
  append(both.first, upper, negative);
  std::vector<uint32_t> lower = upper;
  lower[d] = corners + 1;
  append(both.first, lower, !negative);
  for (uint32_t skip = 0; skip < corners; ++skip) {
    std::vector<uint32_t> around = upper;
    around[skip] = corners + 1;
    append(both.second, around, negative);
  }
  return both;
}

}  // namespace wellspace::test
