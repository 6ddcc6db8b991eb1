// Queries about vertices, which are named by their numbers in the mesh.
#ifndef WELLSPACE_CORE_MESHERS_VERTEX_QUERIES_H_
#define WELLSPACE_CORE_MESHERS_VERTEX_QUERIES_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/input/frame.h"
#include "core/input/vertex_numbering.h"
#include "core/mesh/mesh.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Answers the queries of a Mesher.
//
// Thread safety: thread-compatible; const functions may run at once.
template <int D>
class VertexQueries {
 public:
  // REQUIRES:   all references outlive this.
  VertexQueries(const Frame<D>& frame, const QueryStructure<D>& structure, const VertexNumbering<D>& numbering)
      : frame_(frame), structure_(structure), numbering_(numbering) {}

  // Mesher::NearestNeighborDistances.
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const;

  // Mesher::ClippedCells.
  absl::StatusOr<std::vector<Cell>> ClippedCells(std::span<const uint32_t> vertices, double beta) const;

 private:
  const Frame<D>& frame_;
  const QueryStructure<D>& structure_;
  const VertexNumbering<D>& numbering_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_VERTEX_QUERIES_H_
