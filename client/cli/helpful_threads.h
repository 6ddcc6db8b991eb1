// The number of threads that helps a mesh.
#ifndef WELLSPACE_CLIENT_CLI_HELPFUL_THREADS_H_
#define WELLSPACE_CLIENT_CLI_HELPFUL_THREADS_H_

#include <span>

#include "client/client.h"

namespace wellspace::cli {

// The number of threads to ask for when `points` are meshed and the user has not said how many. Small meshes are faster
// on one: work done ahead is seldom valid there. Servers take no more than they allow, so that cores need not be
// counted here. The mesh does not depend on it.
//
// Shapes:     rows of options.dimension coordinates.
// Guarantees: from 1 to kMostThreads; not fewer for more points, or for smaller sizes.
int HelpfulThreads(const client::MeshOptions& options, std::span<const double> points);

// More are refused by every server.
inline constexpr int kMostThreads = 1024;

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_HELPFUL_THREADS_H_
