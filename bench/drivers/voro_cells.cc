// Computes the Voronoi cell of every point in the unit box by voro++, and reports one JSON object.
#include <cmath>
#include <cstdint>
#include <iostream>
#include <vector>

#include "bench/drivers/meter.h"
#include "nlohmann/json.hpp"
#include "voro++/voro++.hh"

namespace {

// The points in a block of the grid that voro++ recommends.
constexpr double kPointsPerBlock = 5.6;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: bench_voro_cells POINTS\n";
    return 2;
  }
  const std::vector<double> points = wellspace::bench::ReadPoints(argv[1]);
  const int count = static_cast<int>(points.size() / 3);
  const int blocks = static_cast<int>(std::cbrt(count / kPointsPerBlock)) + 1;

  const wellspace::bench::Meter all;
  voro::container container(0, 1, 0, 1, 0, 1, blocks, blocks, blocks, false, false, false, 8);
  for (int i = 0; i < count; ++i) {
    container.put(i, points[3 * i], points[3 * i + 1], points[3 * i + 2]);
  }
  const double loaded = all.Seconds();

  uint64_t cells = 0;
  uint64_t nodes = 0;
  voro::voronoicell cell;  // without its neighbours' numbers, which take it more
  voro::c_loop_all loop(container);
  const wellspace::bench::Meter meter;
  if (loop.start()) {
    do {
      if (container.compute_cell(cell, loop)) {
        ++cells;
        nodes += static_cast<uint64_t>(cell.p);
      }
    } while (loop.inc());
  }
  const double seconds = meter.Seconds();
  const double wall_seconds = meter.WallSeconds();
  const uint64_t memory = all.PeakBytes();

  // Not of the measurement: to compare with those of Wellspace.
  uint64_t facets = 0;
  if (loop.start()) {
    do {
      if (container.compute_cell(cell, loop)) {
        facets += static_cast<uint64_t>(cell.number_of_faces());
      }
    } while (loop.inc());
  }
  std::cout << nlohmann::json{{"seconds", seconds},     {"wall_seconds", wall_seconds},
                              {"load_seconds", loaded}, {"memory_bytes", memory},
                              {"cells", cells},         {"nodes", nodes},
                              {"facets", facets}}
            << '\n';
  return 0;
}
