// The figures of a run.
#ifndef WELLSPACE_CORE_MESH_MESH_STATISTICS_H_
#define WELLSPACE_CORE_MESH_MESH_STATISTICS_H_

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/sliver/left_sliver.h"

namespace wellspace::core {

// Counts of the points, segments and seeds of a domain in the plane, by their treatment.
struct DomainStatistics {
  uint64_t unmeshed_points = 0;    // input points that touch no face which is meshed
  uint64_t segments = 0;           // of the planar graph that bound a face which is meshed; of the box, too
  uint64_t subsegments = 0;        // edges of the mesh on them
  uint64_t dropped_segments = 0;   // of no length, or there before
  uint64_t touching_points = 0;    // that lay on a segment, which was split there
  uint64_t crossings = 0;          // of segments, which were split there
  uint64_t near_points = 0;        // that a segment was led through
  uint64_t unused_seeds = 0;       // points of holes and regions in faces that the rule does not mesh
  uint64_t first_unused_seed = 0;  // the number of the first of them, if there are any
  uint64_t exempt_simplices = 0;   // that break rho, at small angles of the input
  double min_input_angle_deg = 0;  // between two segments with a common end; 180 where there are no two
};

// Counts of the triangles, points and seeds of a domain in space, by their treatment, and how well facets meet them.
struct SurfaceStatistics {
  uint64_t triangles = 0;          // once they are clean
  uint64_t welded_points = 0;      // that became another, which was near
  uint64_t dropped_triangles = 0;  // without an area, or there before
  uint64_t flipped_triangles = 0;  // that go against most of the others around them
  uint64_t unmeshed_points = 0;    // points on no triangle, and in no solid that is meshed
  uint64_t patches = 0;
  uint64_t curves = 0;
  uint64_t corners = 0;
  uint64_t solids = 0;             // that are meshed
  uint64_t facets = 0;             // of the mesh on the surface
  uint64_t ridges = 0;             // edges of the mesh on curves
  uint64_t lost_ridges = 0;        // pieces of curves between vertices that are no edges of the mesh
  uint64_t exempt_simplices = 0;   // that break rho, at small angles of the input
  uint64_t acute_curves = 0;       // at which patches meet at less than 75 degrees
  uint64_t tube_simplices = 0;     // at acute curves and corners, whose angles are those of the input
  uint64_t unused_seeds = 0;       // points of holes and regions in solids that the rule does not mesh
  uint64_t first_unused_seed = 0;  // the number of the first of them, if there are any
  double min_facet_angle_deg = 0;
  double min_angle_outside_deg = 0;  // the smallest dihedral angle of the other tetrahedra
  double deviation_of_facets = 0;    // the largest distance of samples of facets from the surface
  double deviation_of_surface = 0;   // the largest distance of samples of the surface from facets
  double lost_area = 0;              // of triangles around parts that solids by winding lose
  uint64_t cut_triangles = 0;        // at the sides of the box
  uint64_t outside_triangles = 0;    // without a part in the box
  std::vector<double> volumes{};     // by region, in the order of Mesh::regions
};

// The figures of a run: counts of the paper's operations, by which its O(1) claims are tested, and of the mesh.
struct MeshStatistics {
  uint64_t input_points = 0;
  uint64_t duplicates = 0;     // input points equal to another one that is their vertex
  uint64_t merged_points = 0;  // input points whose vertex has other coordinates: within merge_distance
  uint64_t vertices = 0;
  uint64_t simplices = 0;

  std::optional<DomainStatistics> domain{};    // of a domain in the plane
  std::optional<SurfaceStatistics> surface{};  // of a domain in space

  double max_radius_edge = 0;
  double min_angle_deg = 0;  // 2-D: smallest angle of a triangle; 3-D: smallest dihedral angle of a tetrahedron

  // Slivers are tetrahedra below min_dihedral. With no weighted vertices the mesh is Delaunay, and keeps the criterion.
  bool slivers_wanted = false;  // whether they were to be repaired or pumped away; the figures below are then true
  uint64_t slivers = 0;         // that were found, new ones of later refinements included
  uint64_t slivers_left = 0;    // that could not be repaired
  std::array<uint64_t, kSliverReasons> slivers_left_by{};  // by SliverReason; together slivers_left
  std::vector<LeftSliver> flattest_left;                   // of these at most kMostNamedSlivers, flattest first
  uint64_t sliver_operations = 0;                          // tetrahedra that the repair measured, or held a vertex to
  uint64_t simplices_measured = 0;                         // to find slivers, and the worst shapes of a repaired mesh
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
  uint64_t star_leaves_visited = 0;    // for stars that the refinement did not list
  uint64_t star_vertices_visited = 0;  // in these leaves, or of simplices that were listed
  uint64_t star_cuts = 0;  // bisectors that cut a cell, and later vertices that a listed simplex was held to
  uint64_t max_star_leaves_visited = 0;  // at once
  uint64_t exact_predicates = 0;         // decisions that the floating-point filter could not take
  uint64_t perturbed_predicates = 0;     // of these, exact zeros, decided by the perturbation
};

struct QueryCounters;
struct SliverStatistics;

// Sets the counts of queries: of the refinement, and of the simplices.
void SetQueryFigures(const QueryCounters& cells, const QueryCounters& stars, MeshStatistics& statistics);

// Sets the figures of slivers but the numbers of vertices, which are the structure's still; and adds the time of their
// stars to that of the simplices.
void SetSliverFigures(const SliverStatistics& slivers, MeshStatistics& statistics);

// Sets total_seconds from the other times, and peak_memory_bytes.
void SetTotals(MeshStatistics& statistics);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_MESH_STATISTICS_H_
