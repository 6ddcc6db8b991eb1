// Meshes of surfaces as tests make them, and the laws that all of them keep; seen from outside, by other means.
#ifndef WELLSPACE_TESTS_CORE_MESHERS_SPACE_MESHES_H_
#define WELLSPACE_TESTS_CORE_MESHERS_SPACE_MESHES_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "absl/status/statusor.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/meshers/mesher.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {

inline double DiagonalOf(const test::TestSurface& surface) {
  Box<3> box{PointAt<3>(surface.points, 0), PointAt<3>(surface.points, 0)};
  for (size_t i = 0; i < surface.points.size() / 3; ++i) {
    const Point<3> p = PointAt<3>(surface.points, i);
    box.Include({p, p});
  }
  return Distance<3>(box.low, box.high);
}

// Facets of a radius of `facet` and tetrahedra of one of `cell`, the tolerance `tolerance`: shares of the diagonal.
inline MeshParameters Bounds(const test::TestSurface& surface, double facet, double cell, double tolerance) {
  const double diagonal = DiagonalOf(surface);
  MeshParameters parameters;
  parameters.min_dihedral = 0;
  parameters.max_vertices = 20000;
  parameters.surface.edge_length = facet * diagonal / kRadiusPerEdge;
  parameters.max_circumradius = cell * diagonal;
  parameters.surface.tolerance = tolerance * diagonal;
  return parameters;
}

inline absl::StatusOr<Mesh> MeshOf(const test::TestSurface& surface, const MeshParameters& parameters,
                                   SolidRule solids = SolidRule::kEvenOdd) {
  SurfaceFeatures features = surface.Features();
  features.solids = solids;
  RunContext context;
  return MeshPoints(parameters, Input(surface.points, features), context);
}

inline double VolumeOf(const Mesh& mesh) {
  double volume = 0;
  for (size_t s = 0; s < mesh.simplex_count(); ++s) {
    std::array<Point<3>, 4> p;
    for (size_t k = 0; k < 4; ++k) {
      p[k] = PointAt<3>(mesh.points, mesh.simplices[4 * s + k]);
    }
    volume += Dot<3>(Cross(Difference<3>(p[1], p[0]), Difference<3>(p[2], p[0])), Difference<3>(p[3], p[0])) / 6;
  }
  return volume;
}

using Facet = std::array<uint32_t, 3>;

// Of pairs of a tetrahedron and a vertex about so many are looked at.
inline constexpr size_t kMostLooks = 4'000'000;

// How far inside of a circumsphere a point is, relatively to the radius; and the most of it at acute creases, where
// points that mirror each other are on a sphere up to rounding.
inline constexpr double kDepthOfRounding = 1e-9;
inline double DepthIn(const Simplex<3>& corners, const Point<3>& p) {
  const Point<3> offset = ExactCircumcentreOffset<3>(corners);
  Point<3> centre = corners[0];
  for (int axis = 0; axis < 3; ++axis) {
    centre[axis] += offset[axis];
  }
  return 1 - Distance<3>(p, centre) / std::sqrt(NormSq<3>(offset));
}

// Checks, by a look at pairs, that the tetrahedra are Delaunay among all vertices, but by rounding at acute creases;
// that facets are those sides that belong to one tetrahedron or to two of other regions, and meet in pairs at edges
// that are no ridges; and that every vertex is used.
inline void ExpectConforming(const Mesh& mesh) {
  std::map<Facet, std::set<int32_t>> regions_at;
  std::map<Facet, int> tetrahedra_at;
  std::set<uint32_t> used;
  const bool are_some_acute = mesh.statistics.surface.has_value() && mesh.statistics.surface->tube_simplices > 0;
  for (size_t s = 0; s < mesh.simplex_count(); ++s) {
    Simplex<3> corners;
    for (size_t k = 0; k < 4; ++k) {
      corners[k] = PointAt<3>(mesh.points, mesh.simplices[4 * s + k]);
      used.insert(mesh.simplices[4 * s + k]);
      Facet facet;
      for (size_t i = 0, j = 0; i < 4; ++i) {
        if (i != k) {
          facet[j++] = mesh.simplices[4 * s + i];
        }
      }
      std::sort(facet.begin(), facet.end());
      ++tetrahedra_at[facet];
      regions_at[facet].insert(mesh.simplex_regions.empty() ? 0 : mesh.simplex_regions[s]);
    }
    ASSERT_EQ(Orientation<3>(corners).sign, Sign::kPositive);
    const size_t stride = 1 + mesh.simplex_count() * mesh.vertex_count() / kMostLooks;
    for (uint32_t v = 0; v < mesh.vertex_count() && s % stride == 0; ++v) {
      if (InSphere<3>(corners, PointAt<3>(mesh.points, v)).sign == Sign::kPositive) {
        ASSERT_TRUE(are_some_acute) << "tetrahedron " << s;
        ASSERT_LE(DepthIn(corners, PointAt<3>(mesh.points, v)), kDepthOfRounding) << "tetrahedron " << s;
      }
    }
  }
  EXPECT_EQ(used.size(), mesh.vertex_count());
  std::set<Facet> facets;
  std::map<std::pair<uint32_t, uint32_t>, int> facets_at;
  for (size_t f = 0; f < mesh.facet_count(); ++f) {
    Facet facet = {mesh.facets[3 * f], mesh.facets[3 * f + 1], mesh.facets[3 * f + 2]};
    for (size_t k = 0; k < 3; ++k) {
      ++facets_at[std::minmax(facet[k], facet[(k + 1) % 3])];
    }
    std::sort(facet.begin(), facet.end());
    EXPECT_TRUE(facets.insert(facet).second);
    EXPECT_TRUE(tetrahedra_at.contains(facet));
  }
  for (const auto& [facet, count] : tetrahedra_at) {
    ASSERT_LE(count, 2);
    EXPECT_TRUE(facets.contains(facet) || (count == 2 && regions_at[facet].size() == 1));
  }
  std::set<std::pair<uint32_t, uint32_t>> ridges;
  for (size_t r = 0; r < mesh.ridges.size(); r += 2) {
    ridges.insert(std::minmax(mesh.ridges[r], mesh.ridges[r + 1]));
    EXPECT_TRUE(facets_at.contains(std::minmax(mesh.ridges[r], mesh.ridges[r + 1])));
  }
  for (const auto& [edge, count] : facets_at) {
    EXPECT_TRUE(count == 2 || ridges.contains(edge)) << count << " facets at an edge";
  }
}

}  // namespace wellspace::core

#endif  // WELLSPACE_TESTS_CORE_MESHERS_SPACE_MESHES_H_
