// The figures of a finished mesh.
#ifndef WELLSPACE_CLIENT_CLI_STATISTICS_H_
#define WELLSPACE_CLIENT_CLI_STATISTICS_H_

#include <cstdint>
#include <string>

#include "client/client.h"

namespace wellspace::cli {

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
