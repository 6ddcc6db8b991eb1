// Computes the Voronoi cell of every point in the unit box by Wellspace's query structure, and reports one JSON object.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "CLI/App.hpp"
#include "CLI/Config.hpp"
#include "CLI/Formatter.hpp"
#include "bench/drivers/meter.h"
#include "core/input/frame.h"
#include "core/input/sorted_cloud.h"
#include "core/voronoi/query_structure.h"
#include "nlohmann/json.hpp"

namespace wellspace::bench {
namespace {

void ExitUnless(const absl::Status& status) {
  if (!status.ok()) {
    std::cerr << "wellspace: " << status << '\n';
    std::exit(1);
  }
}

// The planes that bound the cell.
int FacetCount(const core::Polytope<3>& cell, std::vector<bool>& is_facet) {
  is_facet.assign(cell.plane_count(), false);
  int count = 0;
  for (const core::CellNode<3>& node : cell.nodes()) {
    for (const uint16_t plane : node.planes) {
      count += is_facet[plane] ? 0 : 1;
      is_facet[plane] = true;
    }
  }
  return count;
}

int Main(int argc, char** argv) {
  CLI::App app("Computes the Voronoi cells of 3-D points in the unit box by Wellspace's query structure");
  std::string path;
  double beta = std::numeric_limits<double>::infinity();
  app.add_option("points", path, "file of doubles")->required();
  bool is_alone = false;
  app.add_option("--beta", beta, "clip at this times the distance to the nearest neighbour; default: whole cells");
  app.add_flag("--alone", is_alone, "ask for each cell on its own, not for all together");
  CLI11_PARSE(app, argc, argv);
  const std::vector<double> points = ReadPoints(path);

  const core::RunContext context;
  const Meter all;
  const auto domain = core::Frame<3>::Of({{0, 0, 0}, {1, 1, 1}});
  ExitUnless(domain.status());
  auto cloud = core::SortCloud<3>(*domain, points, 1, context);
  ExitUnless(cloud.status());
  const size_t count = cloud->points.size();
  core::QueryStructure<3> structure;
  ExitUnless(structure.Initialize(cloud->grid, std::move(cloud->points), uint64_t{1} << 32, 1, context));
  const double loaded = all.Seconds();

  core::Workspace<3> workspace;
  std::vector<core::VertexId> sites(count);  // as they are along the Z curve
  for (uint32_t v = 0; v < count; ++v) {
    sites[v] = core::VertexId{v};
  }
  // Calls f() with each cell in the workspace.
  const auto for_each_cell = [&](auto f) {
    const size_t together = is_alone ? 1 : count;
    for (size_t at = 0; at < count; at += together) {
      structure.ClippedVoronoiOfEach(std::span(sites).subspan(at, together), beta, workspace,
                                     [&](core::VertexId, double) {
                                       f();
                                       return true;
                                     });
    }
  };
  uint64_t nodes = 0;
  const Meter meter;
  for_each_cell([&] { nodes += workspace.cell.nodes().size(); });
  const double seconds = meter.Seconds();
  const double wall_seconds = meter.WallSeconds();
  nlohmann::json report = {{"seconds", seconds},     {"wall_seconds", wall_seconds},
                           {"load_seconds", loaded}, {"memory_bytes", all.PeakBytes()},
                           {"cells", count},         {"nodes", nodes}};
  if (std::isinf(beta)) {
    // Not of the measurement: to compare with those of a peer.
    uint64_t facets = 0;
    std::vector<bool> is_facet;
    for_each_cell([&] { facets += FacetCount(workspace.cell, is_facet); });
    report["facets"] = facets;
  }
  std::cout << report << '\n';
  return 0;
}

}  // namespace
}  // namespace wellspace::bench

int main(int argc, char** argv) { return wellspace::bench::Main(argc, argv); }
