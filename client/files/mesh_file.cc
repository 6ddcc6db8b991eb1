#include "client/files/mesh_file.h"

namespace wellspace::client {

absl::Status MeshFile::Begin(const MeshHeader& header) {
  header_ = header;
  const formats::MeshShape shape = {
      .dimension = header.dimension,
      .vertex_count = header.vertex_count,
      .simplex_count = header.simplex_count,
      .input_vertices = header.statistics.input_points - header.statistics.duplicates,
      .has_weights = header.has_weights,
  };
  absl::StatusOr<std::unique_ptr<formats::MeshWriter>> writer = formats::CreateMesh(path_, format_, shape, stop_);
  if (!writer.ok()) {
    return writer.status();
  }
  writer_ = *std::move(writer);
  return absl::OkStatus();
}

absl::Status MeshFile::AddInputVertices(std::span<const uint32_t> vertices) {
  if (keeps_input_vertices_) {
    input_vertex_.insert(input_vertex_.end(), vertices.begin(), vertices.end());
  }
  return absl::OkStatus();
}

}  // namespace wellspace::client
