// The figures of a mesh as JSON.
#ifndef WELLSPACE_CLIENT_JSON_STATISTICS_H_
#define WELLSPACE_CLIENT_JSON_STATISTICS_H_

#include <cstdint>
#include <span>

#include "client/client.h"
#include "client/json/json.h"

namespace wellspace::client {

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
Json StatisticsJson(const MeshHeader& mesh, std::span<const uint32_t> input_vertex,
                    std::span<const uint32_t> moved_vertices = {});

// "demands", "angle" or "work".
const char* ReasonName(SliverReason reason);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_JSON_STATISTICS_H_
