#include "client/files/mesh_file.h"

#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

// How many vertices, the first of a mesh, are input points.
uint64_t InputVerticesOf(const MeshStatistics& statistics) {
  const uint64_t unmeshed = statistics.domain.has_value() ? statistics.domain->unmeshed_points : 0;
  return statistics.input_points - statistics.duplicates - statistics.merged_points - unmeshed;
}

}  // namespace

absl::Status MeshFile::Begin(const MeshHeader& header) {
  header_ = header;
  formats::MeshShape shape = {
      .dimension = header.dimension,
      .vertex_count = header.vertex_count,
      .simplex_count = header.simplex_count,
      .input_vertices = InputVerticesOf(header.statistics),
      .has_weights = header.has_weights,
      .has_vertex_marks = header.has_vertex_marks,
      .boundary = {},
      .has_simplex_regions = header.has_simplex_regions,
      .regions = {},
      .low = header.domain_low,
      .high = header.domain_high,
  };
  for (const BoundaryPart& part : header.boundary) {
    shape.boundary.push_back({part.tag, part.name, part.facet_count});
  }
  for (const Region& region : header.regions) {
    shape.regions.push_back({region.id, region.name});
  }
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<formats::MeshWriter> writer,
                             formats::CreateMesh(path_, format_, shape, stop_));
  writer_ = std::move(writer);
  return absl::OkStatus();
}

absl::Status MeshFile::AddInputVertices(std::span<const uint32_t> vertices) {
  if (keeps_input_vertices_) {
    input_vertex_.insert(input_vertex_.end(), vertices.begin(), vertices.end());
  }
  return absl::OkStatus();
}

}  // namespace wellspace::client
