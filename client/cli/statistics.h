// What is told about a finished mesh.
#ifndef WELLSPACE_CLIENT_CLI_STATISTICS_H_
#define WELLSPACE_CLIENT_CLI_STATISTICS_H_

#include <cstdint>
#include <span>
#include <string>

#include "client/client.h"

namespace wellspace::cli {

// One JSON object:
//   dimension, domain_low, domain_high
//   input_points, duplicates, vertices, simplices, max_radius_edge, min_angle_deg (2-D) or min_dihedral_deg (above)
//   triangulation: "delaunay" or "regular"
//   slivers:  {found, left, moves, added_vertices, weighted_vertices, min_angle_before_deg, operations,
//             left_by: {demands, angle, work}, flattest_left: [{vertices, min_dihedral_deg, reason}, ...]}, null if
//             nothing was asked for
//   seconds:  {tree, refinement, simplices, ..., total}, without reading and writing files
//   peak_memory_bytes, counters
//   duplicate_of: [[i, v], ...]: input point i is equal to an earlier one, and both became vertex v. The other input
//                 points are, in their order, the first vertices. `input_vertex` says which vertex each became.
//   moved_vertices: the vertices that the session's mesh before had at another place
std::string StatisticsJson(const client::MeshHeader& mesh, std::span<const uint32_t> input_vertex,
                           std::span<const uint32_t> moved_vertices = {});

// "5 points -> 17 vertices, 20 triangles; ...", one line without its end.
std::string Summary(const client::MeshHeader& mesh);

// "warning: 2 slivers are left below --min-dihedral (...)", and a line for each of the flattest; empty if none is left.
std::string SliverWarning(const client::MeshHeader& mesh);

// "warning: …" that the mesh came without its boundary, which was asked for; empty if it has one.
std::string BoundaryWarning(const client::MeshHeader& mesh);

// One JSON object: dimension, vertices, simplices, memory_bytes, tree_leaves.
std::string EstimateJson(const client::MeshEstimate& estimate, int dimension);

// The same for people: lines "vertices  1,234", memory as "1.5 GiB".
std::string EstimateText(const client::MeshEstimate& estimate, int dimension);

// "512 B", "1.5 GiB", "37 MiB": two digits or more, in the largest binary unit of which there is one.
std::string WithBinaryUnit(uint64_t bytes);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_STATISTICS_H_
