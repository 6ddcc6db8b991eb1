#include "tests/core/growth.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/mesher.h"
#include "tests/support/clouds.h"

namespace wellspace::test {
namespace {

// Averages over the queries of one run. Visits and cuts are divided by simplices per vertex, a measure of the cells
// themselves: a cell at the box has fewer nodes, and the share of vertices there falls slowly. (In 3-D, uniform points
// have 4.6 simplices a vertex for n = 10^3 and 6.1 for 10^6; unbounded meshes have 6.5. The plain visits a query rise
// likewise, from 88 to 125, and end there.)
struct Work {
  double queries_per_vertex;
  double visits_per_query;  // leaves and vertices, since the size of leaves shifts one to the other
  double cuts_per_query;
  double visits_per_star;
  double cuts_per_star;
};

double Ratio(uint64_t a, uint64_t b) { return static_cast<double>(a) / static_cast<double>(b); }

Work WorkOf(const core::MeshStatistics& s) {
  const double cell_size = Ratio(s.simplices, s.vertices);
  return {.queries_per_vertex = Ratio(s.cells_computed, s.vertices),
          .visits_per_query = Ratio(s.leaves_visited + s.vertices_visited, s.cells_computed) / cell_size,
          .cuts_per_query = Ratio(s.cuts, s.cells_computed) / cell_size,
          .visits_per_star = Ratio(s.star_leaves_visited + s.star_vertices_visited, s.stars_computed) / cell_size,
          .cuts_per_star = Ratio(s.star_cuts, s.stars_computed) / cell_size};
}

}  // namespace

void ExpectConstantWork(std::string_view kind, int dimension, std::span<const size_t> sizes) {
  // Measured from 10^3 to 10^6: at most 1.15 (visits of uniform points in 3-D). What grew like log n would double.
  constexpr double kMostGrowth = 1.25;
  std::vector<Work> work;
  for (const size_t n : sizes) {
    SCOPED_TRACE(n);
    core::MeshParameters parameters;
    parameters.dimension = dimension;
    parameters.min_dihedral = 0;  // of the query structure's work none is there
    parameters.domain_low = UnitLow(dimension);
    parameters.domain_high = UnitHigh(dimension);
    core::RunContext context;
    const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, MakeCloud(kind, dimension, n), context);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    work.push_back(WorkOf(mesh->statistics));
    EXPECT_GT(work.back().visits_per_star, 0);
    EXPECT_LE(work.back().queries_per_vertex, kMostGrowth * work.front().queries_per_vertex);
    EXPECT_LE(work.back().visits_per_query, kMostGrowth * work.front().visits_per_query);
    EXPECT_LE(work.back().cuts_per_query, kMostGrowth * work.front().cuts_per_query);
    EXPECT_LE(work.back().visits_per_star, kMostGrowth * work.front().visits_per_star);
    EXPECT_LE(work.back().cuts_per_star, kMostGrowth * work.front().cuts_per_star);
  }
}

}  // namespace wellspace::test
