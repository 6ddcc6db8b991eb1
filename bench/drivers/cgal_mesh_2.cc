// Meshes points or segments in the unit square by CGAL's Mesh_2, and reports one JSON object.
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_mesh_face_base_2.h>
#include <CGAL/Delaunay_mesh_size_criteria_2.h>
#include <CGAL/Delaunay_mesh_vertex_base_2.h>
#include <CGAL/Delaunay_mesher_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <array>
#include <cstdlib>
#include <iostream>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/drivers/meter.h"
#include "nlohmann/json.hpp"

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Structure = CGAL::Triangulation_data_structure_2<CGAL::Delaunay_mesh_vertex_base_2<Kernel>,
                                                       CGAL::Delaunay_mesh_face_base_2<Kernel>>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure>;
using Criteria = CGAL::Delaunay_mesh_size_criteria_2<Triangulation>;

}  // namespace

int main(int argc, char** argv) {
  const bool has_segments = argc == 4 && std::string_view(argv[3]) == "--segments";
  if (argc != 3 && !has_segments) {
    std::cerr << "usage: bench_cgal_mesh_2 POINTS SHAPE_BOUND [--segments]\n";
    return 2;
  }
  std::vector<Kernel::Point_2> points;
  {
    const std::vector<double> coordinates = wellspace::bench::ReadPoints(argv[1]);
    points.reserve(coordinates.size() / 2);
    for (size_t i = 0; i < coordinates.size(); i += 2) {
      points.emplace_back(coordinates[i], coordinates[i + 1]);
    }
  }
  const double shape_bound = std::strtod(argv[2], nullptr);

  const wellspace::bench::Meter meter;
  Triangulation triangulation;
  if (has_segments) {
    // By the indices of their ends: CGAL then sorts all points along a curve first.
    std::vector<std::pair<size_t, size_t>> segments(points.size() / 2);
    for (size_t i = 0; i < segments.size(); ++i) {
      segments[i] = {2 * i, 2 * i + 1};
    }
    triangulation.insert_constraints(points.begin(), points.end(), segments.begin(), segments.end());
  } else {
    triangulation.insert(points.begin(), points.end());
  }
  const std::array<Kernel::Point_2, 4> corners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  for (size_t i = 0; i < corners.size(); ++i) {
    triangulation.insert_constraint(corners[i], corners[(i + 1) % corners.size()]);
  }
  CGAL::refine_Delaunay_mesh_2(triangulation, Criteria(shape_bound, 0));
  const double seconds = meter.Seconds();
  const double wall_seconds = meter.WallSeconds();
  std::cout << nlohmann::json{{"seconds", seconds},
                              {"wall_seconds", wall_seconds},
                              {"memory_bytes", meter.PeakBytes()},
                              {"vertices", triangulation.number_of_vertices()},
                              {"simplices", triangulation.number_of_faces()}}
            << '\n';
  return 0;
}
