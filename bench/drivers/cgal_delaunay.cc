// Triangulates points by CGAL's Delaunay_triangulation_2 or _3, without refinement, and reports one JSON object.
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <iostream>
#include <string_view>
#include <vector>

#include "bench/drivers/meter.h"
#include "nlohmann/json.hpp"

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

std::vector<Kernel::Point_2> Points2(const std::vector<double>& coordinates) {
  std::vector<Kernel::Point_2> points;
  points.reserve(coordinates.size() / 2);
  for (size_t i = 0; i < coordinates.size(); i += 2) {
    points.emplace_back(coordinates[i], coordinates[i + 1]);
  }
  return points;
}

std::vector<Kernel::Point_3> Points3(const std::vector<double>& coordinates) {
  std::vector<Kernel::Point_3> points;
  points.reserve(coordinates.size() / 3);
  for (size_t i = 0; i < coordinates.size(); i += 3) {
    points.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);
  }
  return points;
}

template <typename Triangulation, typename Points, typename Count>
void Measure(const Points& points, Count simplex_count) {
  const wellspace::bench::Meter meter;
  Triangulation triangulation;
  triangulation.insert(points.begin(), points.end());
  const double seconds = meter.Seconds();
  const double wall_seconds = meter.WallSeconds();
  std::cout << nlohmann::json{{"seconds", seconds},
                              {"wall_seconds", wall_seconds},
                              {"memory_bytes", meter.PeakBytes()},
                              {"vertices", triangulation.number_of_vertices()},
                              {"simplices", simplex_count(triangulation)}}
            << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view dimension = argc == 3 ? argv[2] : "";
  if (dimension == "2") {
    Measure<CGAL::Delaunay_triangulation_2<Kernel>>(Points2(wellspace::bench::ReadPoints(argv[1])),
                                                    [](const auto& made) { return made.number_of_faces(); });
  } else if (dimension == "3") {
    Measure<CGAL::Delaunay_triangulation_3<Kernel>>(Points3(wellspace::bench::ReadPoints(argv[1])),
                                                    [](const auto& made) { return made.number_of_finite_cells(); });
  } else {
    std::cerr << "usage: bench_cgal_delaunay POINTS 2|3\n";
    return 2;
  }
  return 0;
}
