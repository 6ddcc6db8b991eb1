// The figures of a mesher's work so far, for statistics and for Update.
#ifndef WELLSPACE_CORE_MESHERS_MESHER_FIGURES_H_
#define WELLSPACE_CORE_MESHERS_MESHER_FIGURES_H_

#include <cstdint>

#include "core/mesh/mesh.h"
#include "core/mesh/mesh_statistics.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

struct MesherFigures {
  // Counts of the last mesh that was made.
  uint64_t extracted_vertices = 0;
  uint64_t extracted_simplices = 0;
  // Costs of all work so far.
  QueryCounters star_queries;  // for simplices
  double tree_seconds = 0;
  double refinement_seconds = 0;
  double simplices_seconds = 0;

  void NoteMesh(const Mesh& mesh) {
    extracted_vertices = mesh.vertex_count();
    extracted_simplices = mesh.simplex_count();
  }

  void SetSeconds(MeshStatistics& statistics) const {
    statistics.tree_seconds = tree_seconds;
    statistics.refinement_seconds = refinement_seconds;
    statistics.simplices_seconds = simplices_seconds;
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_MESHER_FIGURES_H_
