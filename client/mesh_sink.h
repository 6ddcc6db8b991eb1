// The sink of a mesh, into which it goes while it arrives.
#ifndef WELLSPACE_CLIENT_MESH_SINK_H_
#define WELLSPACE_CLIENT_MESH_SINK_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "client/types.h"

namespace wellspace::client {

// Takes a mesh piece by piece, so that it need not fit into memory.
//
// Calls come in the order of the functions below, from one thread, those for the arrays as often as there are pieces of
// them. Pieces are whole rows; pieces of one array follow one another, and add up to the counts of the header; every
// number of a vertex is below vertex_count. Each piece comes once, however often the connection broke meanwhile. After
// an error no further call comes, and the client's call returns the error.
class MeshSink {
 public:
  MeshSink() = default;
  virtual ~MeshSink() = default;
  MeshSink(const MeshSink&) = delete;
  MeshSink& operator=(const MeshSink&) = delete;

  // Whether the server is asked for the boundary, the regions and the origins of vertices, too.
  virtual bool WantsBoundary() const { return false; }

  virtual absl::Status Begin(const MeshHeader& header) = 0;
  // Rows of `dimension` coordinates.
  virtual absl::Status AddPoints(std::span<const double> points) = 0;
  // Vertices of the last piece of points that have moved since the session's mesh before. Called only if there are any.
  virtual absl::Status AddMovedVertices(std::span<const uint32_t> /*vertices*/) { return absl::OkStatus(); }
  // The next vertices' weights, if the header has_weights.
  virtual absl::Status AddWeights(std::span<const double> weights) = 0;
  // The next vertices' origins, then the next vertices' tags, if the header has_vertex_marks.
  virtual absl::Status AddVertexOrigins(std::span<const uint32_t> /*origins*/) { return absl::OkStatus(); }
  virtual absl::Status AddVertexTags(std::span<const int32_t> /*tags*/) { return absl::OkStatus(); }
  // The next simplices' regions, if the header has_simplex_regions.
  virtual absl::Status AddSimplexRegions(std::span<const int32_t> /*regions*/) { return absl::OkStatus(); }
  // Rows of dimension + 1 vertices.
  virtual absl::Status AddSimplices(std::span<const uint32_t> simplices) = 0;
  // For the next input points the vertices that they became.
  virtual absl::Status AddInputVertices(std::span<const uint32_t> vertices) = 0;
  // Rows of `dimension` vertices: the facets of the header's first part of the boundary, then of its second, …
  virtual absl::Status AddFacets(std::span<const uint32_t> /*facets*/) { return absl::OkStatus(); }
  // Rows of 2 vertices: the edges on creases of a surface. Called only if there are any.
  virtual absl::Status AddRidges(std::span<const uint32_t> /*ridges*/) { return absl::OkStatus(); }
  // Of a part: the next numbers of an array of it, one for each vertex, simplex or facet; array after array.
  virtual absl::Status AddPartNumbers(PartNumbers /*array*/, std::span<const uint32_t> /*numbers*/) {
    return absl::OkStatus();
  }
  // The mesh is complete.
  virtual absl::Status Finish() = 0;
};

// Has `mesh` be of this header, but for the arrays.
void SetHeader(const MeshHeader& header, Mesh& mesh);

// Keeps the whole mesh in memory, which grows with the chunks that arrive, not with the announced sizes.
//
// Thread safety: thread-compatible.
class MeshCollector final : public MeshSink {
 public:
  bool WantsBoundary() const override { return true; }
  absl::Status Begin(const MeshHeader& header) override;
  absl::Status AddPoints(std::span<const double> points) override;
  absl::Status AddMovedVertices(std::span<const uint32_t> vertices) override;
  absl::Status AddWeights(std::span<const double> weights) override;
  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override;
  absl::Status AddVertexTags(std::span<const int32_t> tags) override;
  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override;
  absl::Status AddSimplices(std::span<const uint32_t> simplices) override;
  absl::Status AddInputVertices(std::span<const uint32_t> vertices) override;
  absl::Status AddFacets(std::span<const uint32_t> facets) override;
  absl::Status AddRidges(std::span<const uint32_t> ridges) override;
  absl::Status AddPartNumbers(PartNumbers array, std::span<const uint32_t> numbers) override;
  absl::Status Finish() override { return absl::OkStatus(); }

  // The mesh that has been collected; to be moved from when the mesh is complete.
  Mesh& mesh() { return mesh_; }
  // The properties that came before its arrays.
  const MeshHeader& header() const { return header_; }

 private:
  MeshHeader header_;
  Mesh mesh_;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_MESH_SINK_H_
