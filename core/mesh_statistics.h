// What a run did, in figures.
#ifndef WELLSPACE_CORE_MESH_STATISTICS_H_
#define WELLSPACE_CORE_MESH_STATISTICS_H_

#include <array>
#include <cstdint>
#include <vector>

#include "core/sliver/left_sliver.h"

namespace wellspace::core {

// What a run did: counts of the paper's operations, by which its O(1) claims are tested, and the figures of the mesh.
struct MeshStatistics {
  uint64_t input_points = 0;
  uint64_t duplicates = 0;     // input points equal to another one that is their vertex
  uint64_t merged_points = 0;  // input points whose vertex has other coordinates: within merge_distance
  uint64_t vertices = 0;
  uint64_t simplices = 0;

  double max_radius_edge = 0;
  double min_angle_deg = 0;  // 2-D: smallest angle of a triangle; 3-D: smallest dihedral angle of a tetrahedron

  // Slivers are tetrahedra below min_dihedral. With no weighted vertices the mesh is Delaunay, and keeps the criterion.
  bool slivers_are_asked_about =
      false;                  // whether they were to be repaired or pumped away; the figures below are then true
  uint64_t slivers = 0;       // that were found, new ones of later refinements included
  uint64_t slivers_left = 0;  // that could not be repaired
  std::array<uint64_t, kSliverReasons> slivers_left_by{};  // by SliverReason; together slivers_left
  std::vector<LeftSliver> flattest_left;                   // of these at most kMostNamedSlivers, flattest first
  uint64_t sliver_operations = 0;                          // tetrahedra that the repair measured, or held a vertex to
  uint64_t sliver_moves = 0;                               // of vertices
  uint64_t sliver_vertices = 0;                            // added against them
  uint64_t weighted_vertices = 0;                          // by pumping
  double min_angle_before_deg = 0;                         // of the mesh before; 0 if nothing was repaired or pumped

  double tree_seconds = 0;
  double refinement_seconds = 0;
  double simplices_seconds = 0;
  double sliver_seconds = 0;
  double total_seconds = 0;
  uint64_t peak_memory_bytes = 0;  // of the whole process

  uint64_t tree_leaves = 0;     // when the mesh was done
  uint64_t cells_computed = 0;  // ClippedVoronoi queries of the refinement
  uint64_t leaves_visited = 0;  // by them
  uint64_t vertices_visited = 0;
  uint64_t cuts = 0;
  uint64_t max_leaves_visited = 0;     // by a single one
  uint64_t stars_computed = 0;         // of vertices, for the simplices
  uint64_t star_leaves_visited = 0;    // for those that were not listed by the refinement
  uint64_t star_vertices_visited = 0;  // in these leaves, or of simplices that were listed
  uint64_t star_cuts = 0;  // bisectors that cut a cell, and later vertices that a listed simplex was held to
  uint64_t max_star_leaves_visited = 0;  // at once
  uint64_t exact_predicates = 0;         // decisions that the floating-point filter could not take
  uint64_t perturbed_predicates = 0;     // of these, exact zeros, decided by the perturbation
};

struct QueryCounters;
struct SliverStatistics;

// Sets the counts of queries: those of the refinement, and those of the simplices.
void SetQueryFigures(const QueryCounters& cells, const QueryCounters& stars, MeshStatistics& statistics);

// Sets what is said of slivers but the numbers of vertices,
// which are those of the structure still; and adds the time of their stars to that of the simplices.
void SetSliverFigures(const SliverStatistics& slivers, MeshStatistics& statistics);

// Sets total_seconds from the other times, and peak_memory_bytes.
void SetTotals(MeshStatistics& statistics);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_STATISTICS_H_
