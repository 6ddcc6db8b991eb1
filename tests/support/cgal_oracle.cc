#include "tests/support/cgal_oracle.h"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <utility>
#include <vector>

namespace wellspace::test {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point2 = Kernel::Point_2;
using Point3 = Kernel::Point_3;
using Delaunay2 = CGAL::Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<CGAL::Triangulation_vertex_base_with_info_2<uint32_t, Kernel>>>;
using Delaunay3 = CGAL::Delaunay_triangulation_3<
    Kernel, CGAL::Triangulation_data_structure_3<CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>,
                                                 CGAL::Delaunay_triangulation_cell_base_3<Kernel>>>;

using Regular3 = CGAL::Regular_triangulation_3<
    Kernel,
    CGAL::Triangulation_data_structure_3<CGAL::Triangulation_vertex_base_with_info_3<
                                             uint32_t, Kernel, CGAL::Regular_triangulation_vertex_base_3<Kernel>>,
                                         CGAL::Regular_triangulation_cell_base_3<Kernel>>>;

Point2 ToCgal(const core::Point<2>& p) { return {p[0], p[1]}; }
Point3 ToCgal(const core::Point<3>& p) { return {p[0], p[1], p[2]}; }

core::Sign ToSign(int sign) { return static_cast<core::Sign>(sign > 0 ? 1 : sign < 0 ? -1 : 0); }

}  // namespace

TestMesh CgalDelaunay(int dimension, std::span<const double> points) {
  TestMesh mesh{.dimension = dimension, .points = {points.begin(), points.end()}, .simplices = {}};
  const auto count = static_cast<uint32_t>(mesh.VertexCount());
  if (dimension == 2) {
    std::vector<std::pair<Point2, uint32_t>> numbered;
    for (uint32_t v = 0; v < count; ++v) {
      numbered.emplace_back(Point2(points[2 * v], points[2 * v + 1]), v);
    }
    const Delaunay2 delaunay(numbered.begin(), numbered.end());
    for (auto face = delaunay.finite_faces_begin(); face != delaunay.finite_faces_end(); ++face) {
      for (int i = 0; i < 3; ++i) {
        mesh.simplices.push_back(face->vertex(i)->info());
      }
    }
  } else {
    std::vector<std::pair<Point3, uint32_t>> numbered;
    for (uint32_t v = 0; v < count; ++v) {
      numbered.emplace_back(Point3(points[3 * v], points[3 * v + 1], points[3 * v + 2]), v);
    }
    const Delaunay3 delaunay(numbered.begin(), numbered.end());
    for (auto cell = delaunay.finite_cells_begin(); cell != delaunay.finite_cells_end(); ++cell) {
      for (int i = 0; i < 4; ++i) {
        mesh.simplices.push_back(cell->vertex(i)->info());
      }
    }
  }
  return mesh;
}

TestMesh CgalRegular(std::span<const double> points, std::span<const double> weights) {
  TestMesh mesh{.dimension = 3, .points = {points.begin(), points.end()}, .simplices = {}};
  std::vector<std::pair<Regular3::Weighted_point, uint32_t>> numbered;
  for (uint32_t v = 0; v < weights.size(); ++v) {
    numbered.emplace_back(
        Regular3::Weighted_point(Point3(points[3 * v], points[3 * v + 1], points[3 * v + 2]), weights[v]), v);
  }
  const Regular3 regular(numbered.begin(), numbered.end());
  for (auto cell = regular.finite_cells_begin(); cell != regular.finite_cells_end(); ++cell) {
    for (int i = 0; i < 4; ++i) {
      mesh.simplices.push_back(cell->vertex(i)->info());
    }
  }
  return mesh;
}

template <int D>
core::Sign CgalOrientation(const core::Simplex<D>& simplex) {
  if constexpr (D == 2) {
    return ToSign(CGAL::orientation(ToCgal(simplex[0]), ToCgal(simplex[1]), ToCgal(simplex[2])));
  } else {
    return ToSign(CGAL::orientation(ToCgal(simplex[0]), ToCgal(simplex[1]), ToCgal(simplex[2]), ToCgal(simplex[3])));
  }
}

template <int D>
core::Sign CgalInSphere(const core::Simplex<D>& simplex, const core::Point<D>& q) {
  if constexpr (D == 2) {
    return ToSign(CGAL::side_of_oriented_circle(ToCgal(simplex[0]), ToCgal(simplex[1]), ToCgal(simplex[2]), ToCgal(q)));
  } else {
    return ToSign(CGAL::side_of_oriented_sphere(ToCgal(simplex[0]), ToCgal(simplex[1]), ToCgal(simplex[2]),
                                                ToCgal(simplex[3]), ToCgal(q)));
  }
}

template core::Sign CgalOrientation<2>(const core::Simplex<2>&);
template core::Sign CgalOrientation<3>(const core::Simplex<3>&);
template core::Sign CgalInSphere<2>(const core::Simplex<2>&, const core::Point<2>&);
template core::Sign CgalInSphere<3>(const core::Simplex<3>&, const core::Point<3>&);

}  // namespace wellspace::test
