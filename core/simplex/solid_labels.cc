#include "core/simplex/solid_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

// Tetrahedra that one thread labels at a time, and between two looks at the context.
constexpr size_t kLabelledTogether = size_t{1} << 14;
constexpr size_t kLabelledBetweenChecks = 64;

// What is no deeper than this share of the coordinates is not told from a common facet: points of the mesh are rounded.
constexpr double kShallow = 0x1p-40;
// Edges that are parallel but for this sine have no direction across both.
constexpr double kParallel = 0x1p-40;

using Tetrahedron = Simplex<3>;

// The mean of the corners, which are added up in the order of their coordinates.
Point<3> CentroidOf(Tetrahedron corners) {
  std::sort(corners.begin(), corners.end());
  Point<3> centroid{};
  for (const Point<3>& corner : corners) {
    for (int axis = 0; axis < 3; ++axis) {
      centroid[axis] += 0.25 * corner[axis];
    }
  }
  return centroid;
}

// How far a triangle and a tetrahedron reach into each other along an axis; infinite along none.
double DepthAlong(const Tetrahedron& tetrahedron, const Triangle& triangle, const Point<3>& axis, double least_length) {
  const double length = std::sqrt(NormSq<3>(axis));
  if (!(length > least_length)) {
    return std::numeric_limits<double>::infinity();
  }
  const auto range_of = [&](const auto& corners) {
    // From a corner: what is far from the origin has short differences.
    std::array<double, 2> range = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (const Point<3>& corner : corners) {
      const double at = Dot<3>(axis, Difference<3>(corner, tetrahedron[0]));
      range = {std::min(range[0], at), std::max(range[1], at)};
    }
    return range;
  };
  const std::array<double, 2> of_tetrahedron = range_of(tetrahedron);
  const std::array<double, 2> of_triangle = range_of(triangle);
  return std::min(of_tetrahedron[1] - of_triangle[0], of_triangle[1] - of_tetrahedron[0]) / length;
}

// Whether a triangle reaches into a tetrahedron by more than `shallow`: along the normals of both, and along whatever
// is across an edge of each, of which one would tell two convex bodies apart.
bool IsCutBy(const Tetrahedron& tetrahedron, const Triangle& triangle, double shallow) {
  std::array<Point<3>, 6> edges;
  size_t count = 0;
  for (size_t i = 0; i < 4; ++i) {
    for (size_t k = i + 1; k < 4; ++k) {
      edges[count++] = Difference<3>(tetrahedron[k], tetrahedron[i]);
    }
  }
  const std::array<Point<3>, 3> sides = {Difference<3>(triangle[1], triangle[0]),
                                         Difference<3>(triangle[2], triangle[1]),
                                         Difference<3>(triangle[0], triangle[2])};
  const auto is_deep = [&](const Point<3>& a, const Point<3>& b) {
    const double least_length = kParallel * std::sqrt(NormSq<3>(a) * NormSq<3>(b));
    return DepthAlong(tetrahedron, triangle, Cross(a, b), least_length) > shallow;
  };
  // The facets at the first corner, and the one across from it.
  if (!is_deep(sides[0], sides[1]) || !is_deep(edges[0], edges[1]) || !is_deep(edges[0], edges[2]) ||
      !is_deep(edges[1], edges[2]) || !is_deep(edges[3], edges[4])) {
    return false;
  }
  return std::all_of(edges.begin(), edges.end(), [&](const Point<3>& edge) {
    return std::all_of(sides.begin(), sides.end(), [&](const Point<3>& side) { return is_deep(edge, side); });
  });
}

double LargestOf(std::span<const double> coordinates) {
  double largest = 0;
  for (const double x : coordinates) {
    largest = std::max(largest, std::abs(x));
  }
  return largest;
}

}  // namespace

absl::StatusOr<SolidLabels> LabelSimplices(const SurfaceIndex& index, std::span<const double> points,
                                           std::span<const uint32_t> simplices, int threads,
                                           const RunContext& context) {
  const size_t count = simplices.size() / 4;
  // A label each; those that are cut, as they are found and joined.
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(index.MemoryBytes() + points.size_bytes() + simplices.size_bytes() +
                                                3 * count * sizeof(uint32_t)));
  SolidLabels labels;
  labels.solid_of.resize(count);
  const size_t blocks = (count + kLabelledTogether - 1) / kLabelledTogether;
  std::vector<std::vector<uint32_t>> cut(blocks);
  const auto label = [&](size_t block) -> absl::Status {
    std::vector<uint32_t> near;
    const size_t end = std::min(count, (block + 1) * kLabelledTogether);
    for (size_t s = block * kLabelledTogether; s < end; ++s) {
      if (s % kLabelledBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      Tetrahedron tetrahedron;
      for (size_t k = 0; k < 4; ++k) {
        tetrahedron[k] = PointAt<3>(points, simplices[4 * s + k]);
      }
      labels.solid_of[s] = index.SolidAt(CentroidOf(tetrahedron));
      Box<3> box{tetrahedron[0], tetrahedron[0]};
      double largest = 0;
      for (const Point<3>& corner : tetrahedron) {
        box.Include({corner, corner});
        largest = std::max(largest, LargestOf(corner));
      }
      index.FindNear(box, near);
      if (std::any_of(near.begin(), near.end(),
                      [&](uint32_t t) { return IsCutBy(tetrahedron, index.TriangleAt(t), kShallow * largest); })) {
        cut[block].push_back(static_cast<uint32_t>(s));
      }
    }
    return absl::OkStatus();
  };
  WELLSPACE_RETURN_IF_ERROR(ThreadTeam(threads).TryForEach(blocks, label));
  for (const std::vector<uint32_t>& of_block : cut) {
    labels.cut.insert(labels.cut.end(), of_block.begin(), of_block.end());
  }
  return labels;
}

}  // namespace wellspace::core
