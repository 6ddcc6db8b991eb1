#include "core/mesh/mesh_statistics.h"

#include <sys/resource.h>

#include "core/sliver/sliver_stage.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

void SetQueryFigures(const QueryCounters& cells, const QueryCounters& stars, MeshStatistics& statistics) {
  statistics.cells_computed = cells.queries;
  statistics.leaves_visited = cells.leaves;
  statistics.vertices_visited = cells.vertices;
  statistics.cuts = cells.cuts;
  statistics.max_leaves_visited = cells.max_leaves;
  statistics.stars_computed = stars.queries;
  statistics.star_leaves_visited = stars.leaves;
  statistics.star_vertices_visited = stars.vertices;
  statistics.star_cuts = stars.cuts;
  statistics.max_star_leaves_visited = stars.max_leaves;
  statistics.exact_predicates = cells.decisions.exact + stars.decisions.exact;
  statistics.perturbed_predicates = cells.decisions.perturbed + stars.decisions.perturbed;
}

void SetSliverFigures(const SliverStatistics& slivers, MeshStatistics& statistics) {
  statistics.slivers_wanted = slivers.slivers_wanted;
  statistics.slivers = slivers.slivers;
  statistics.slivers_left = slivers.slivers_left;
  statistics.slivers_left_by = slivers.left_by;
  statistics.flattest_left = slivers.flattest_left;
  statistics.sliver_operations = slivers.operations;
  statistics.simplices_measured = slivers.measured;
  statistics.sliver_moves = slivers.moves;
  statistics.sliver_vertices = slivers.added;
  statistics.weighted_vertices = slivers.weighted;
  statistics.min_angle_before_deg = slivers.min_angle_deg.value_or(0);
  statistics.simplices_seconds += slivers.star_seconds;
  statistics.sliver_seconds = slivers.seconds;
}

void SetTotals(MeshStatistics& statistics) {
  statistics.total_seconds = statistics.tree_seconds + statistics.refinement_seconds + statistics.simplices_seconds +
                             statistics.sliver_seconds;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  statistics.peak_memory_bytes = static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace wellspace::core
