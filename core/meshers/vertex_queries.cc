#include "core/meshers/vertex_queries.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/mesh/mesh_parts.h"

namespace wellspace::core {

template <int D>
absl::StatusOr<std::vector<double>> VertexQueries<D>::NearestNeighborDistances(
    std::span<const uint32_t> vertices) const {
  WELLSPACE_RETURN_IF_ERROR(CheckVertices(vertices, structure_.vertex_count()));
  std::vector<double> distances;
  distances.reserve(vertices.size());
  Workspace<D> workspace;
  for (const uint32_t vertex : vertices) {
    const double distance_sq = structure_.NearestNeighbor(numbering_.VertexOf(vertex), workspace).distance_sq;
    distances.push_back(std::sqrt(distance_sq) / frame_.scale);
  }
  return distances;
}

template <int D>
absl::StatusOr<std::vector<Cell>> VertexQueries<D>::ClippedCells(std::span<const uint32_t> vertices,
                                                                 double beta) const {
  WELLSPACE_RETURN_IF_ERROR(CheckVertices(vertices, structure_.vertex_count()));
  if (!(beta >= 1)) {
    return absl::InvalidArgumentError(absl::StrCat("beta: ", beta, " is not allowed; a number of at least 1 is"));
  }
  // The vertices of one leaf one after the other, since cells of vertices near each other take less time.
  std::vector<std::pair<NodeId, size_t>> order;
  order.reserve(vertices.size());
  for (size_t i = 0; i < vertices.size(); ++i) {
    order.emplace_back(structure_.tree().leaf_of(numbering_.VertexOf(vertices[i])), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<VertexId> sites;
  sites.reserve(vertices.size());
  for (const auto& [leaf, i] : order) {
    sites.push_back(numbering_.VertexOf(vertices[i]));
  }
  std::vector<Cell> cells(vertices.size());
  auto next = order.begin();
  absl::Status status;
  Workspace<D> workspace;
  structure_.ClippedVoronoiOfEach(sites, beta, workspace, [&](VertexId, double radius) {
    const size_t i = (next++)->second;
    if (workspace.cell.IsTooLarge()) {
      status = absl::FailedPreconditionError(absl::StrCat("the cell of vertex ", vertices[i], " has more than ",
                                                          kMostNodes<D>,
                                                          " nodes; refine first, or ask with a smaller beta"));
      return false;
    }
    cells[i] = DescribeCell<D>(vertices[i], radius, workspace.cell, frame_,
                               [this](VertexId u) { return numbering_.OutputIndex(u); });
    return true;
  });
  WELLSPACE_RETURN_IF_ERROR(status);
  return cells;
}

#define WELLSPACE_INSTANTIATE(D) template class VertexQueries<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
