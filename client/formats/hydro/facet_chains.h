// Edges of a boundary as strings of nodes, for formats that have them so. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_HYDRO_FACET_CHAINS_H_
#define WELLSPACE_CLIENT_FORMATS_HYDRO_FACET_CHAINS_H_

#include <cstdint>
#include <span>
#include <vector>

namespace wellspace::formats {

// The edges, each from its first vertex to its second, one after the other: an edge that begins where the last one has
// ended goes on with its chain. A chain that ends where it begins has that vertex twice.
//
// Shapes:     edges: n x 2.
// Guarantees: every edge is in one chain, in its direction. A chain does not begin where another edge ends, unless all
//             edges there have others before them.
// Complexity: O(n log n).
std::vector<std::vector<uint32_t>> ChainsOf(std::span<const uint32_t> edges);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_HYDRO_FACET_CHAINS_H_
