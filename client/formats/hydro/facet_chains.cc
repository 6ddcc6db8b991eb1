#include "client/formats/hydro/facet_chains.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace wellspace::formats {

std::vector<std::vector<uint32_t>> ChainsOf(std::span<const uint32_t> edges) {
  const size_t count = edges.size() / 2;
  // Edges by where they begin, then by their order; how many begin at a vertex more than end there.
  std::vector<size_t> by_begin(count);
  std::iota(by_begin.begin(), by_begin.end(), size_t{0});
  std::stable_sort(by_begin.begin(), by_begin.end(),
                   [edges](size_t a, size_t b) { return edges[2 * a] < edges[2 * b]; });
  std::map<uint32_t, size_t> next;  // the first edge in by_begin that begins at a vertex and is not taken
  std::map<uint32_t, int64_t> surplus;
  for (size_t i = count; i-- > 0;) {
    next[edges[2 * by_begin[i]]] = i;
  }
  for (size_t edge = 0; edge < count; ++edge) {
    ++surplus[edges[2 * edge]];
    --surplus[edges[2 * edge + 1]];
  }
  std::vector<uint8_t> is_taken(count);
  std::vector<std::vector<uint32_t>> chains;
  const auto follow = [&](size_t edge) {
    std::vector<uint32_t> chain = {edges[2 * edge]};
    while (true) {
      is_taken[edge] = 1;
      chain.push_back(edges[2 * edge + 1]);
      const auto at = next.find(chain.back());
      if (at == next.end()) {
        break;
      }
      size_t& i = at->second;
      while (i < count && edges[2 * by_begin[i]] == chain.back() && is_taken[by_begin[i]] != 0) {
        ++i;
      }
      if (chain.back() == chain.front() || i == count || edges[2 * by_begin[i]] != chain.back()) {
        break;
      }
      edge = by_begin[i];
    }
    chains.push_back(std::move(chain));
  };
  // Open chains first, from their ends.
  for (size_t edge = 0; edge < count; ++edge) {
    if (int64_t& begins = surplus[edges[2 * edge]]; is_taken[edge] == 0 && begins > 0) {
      --begins;
      follow(edge);
    }
  }
  for (size_t edge = 0; edge < count; ++edge) {
    if (is_taken[edge] == 0) {
      follow(edge);
    }
  }
  return chains;
}

}  // namespace wellspace::formats
