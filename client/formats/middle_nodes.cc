#include "client/formats/middle_nodes.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kRowsPerCheck = 1 << 14;  // of whether the work is cancelled

absl::Status CancelledListing() { return absl::CancelledError("cancelled while the edges of the mesh were listed"); }

// Calls `use` with the ends of each edge of elements with `corners` corners, of `vertices` vertices.
template <typename Use>
absl::Status ForEachEdgeOf(std::span<const uint32_t> elements, size_t corners, uint64_t vertices,
                           const std::stop_token& stop, Use use) {
  const size_t edges = corners * (corners - 1) / 2;
  while (!elements.empty()) {
    if (stop.stop_requested()) {
      return CancelledListing();
    }
    std::span<const uint32_t> block = elements.first(std::min(elements.size(), kRowsPerCheck * corners));
    elements = elements.subspan(block.size());
    if (const uint32_t highest = *std::max_element(block.begin(), block.end()); highest >= vertices) {
      return absl::InvalidArgumentError(
          absl::StrCat("a mesh of ", vertices, " vertices has an element of vertex ", highest));
    }
    for (; !block.empty(); block = block.subspan(corners)) {
      for (size_t edge = 0; edge < edges; ++edge) {
        const auto [low, high] = std::minmax(block[kElementEdges[edge][0]], block[kElementEdges[edge][1]]);
        use(low, high);
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MiddleNodes> MiddleNodes::Of(const MeshView& mesh, const std::stop_token& stop) {
  const uint64_t vertices = mesh.vertex_count();
  const size_t corners = mesh.dimension + 1;
  const auto for_each = [&](auto use) {
    const absl::Status status = ForEachEdgeOf(mesh.simplices, corners, vertices, stop, use);
    return status.ok() ? ForEachEdgeOf(mesh.facets, corners - 1, vertices, stop, use) : status;
  };
  MiddleNodes nodes;
  // Edges are counted, then put in place by their lower ends, then sorted there.
  nodes.first_.assign(vertices + 1, 0);
  WELLSPACE_RETURN_IF_ERROR(for_each([&](uint32_t low, uint32_t) { ++nodes.first_[low]; }));
  uint64_t count = 0;
  for (uint64_t& first : nodes.first_) {
    count += std::exchange(first, count);
  }
  nodes.highs_.resize(count);
  WELLSPACE_RETURN_IF_ERROR(for_each([&](uint32_t low, uint32_t high) { nodes.highs_[nodes.first_[low]++] = high; }));
  uint64_t begin = 0;  // of the edges of a vertex as they came, which end where the next ones began
  uint64_t kept = 0;
  for (uint64_t vertex = 0; vertex < vertices; ++vertex) {
    if (vertex % kRowsPerCheck == 0 && stop.stop_requested()) {
      return CancelledListing();
    }
    const uint64_t end = std::exchange(nodes.first_[vertex], kept);
    std::sort(nodes.highs_.begin() + begin, nodes.highs_.begin() + end);
    for (; begin < end; ++begin) {
      const uint32_t high = nodes.highs_[begin];
      if (kept == nodes.first_[vertex] || nodes.highs_[kept - 1] != high) {
        nodes.highs_[kept++] = high;
      }
    }
  }
  nodes.first_[vertices] = kept;
  nodes.highs_.resize(kept);
  constexpr uint64_t kMaxNodes = std::numeric_limits<uint32_t>::max();
  if (vertices + kept > kMaxNodes) {
    return absl::InvalidArgumentError(absl::StrCat("a mesh of second order would have ", vertices + kept,
                                                   " nodes; expected at most ", kMaxNodes,
                                                   ": a mesh of larger elements, or order 1"));
  }
  return nodes;
}

}  // namespace wellspace::formats
