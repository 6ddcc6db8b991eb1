#include "client/mesh_sink.h"

namespace wellspace::client {

void SetHeader(const MeshHeader& header, Mesh& mesh) {
  mesh.dimension = header.dimension;
  mesh.domain_low = header.domain_low;
  mesh.domain_high = header.domain_high;
  mesh.boundary = header.boundary;
  mesh.regions = header.regions;
  mesh.statistics = header.statistics;
  mesh.revision = header.revision;
  mesh.part.reset();
  if (header.part.has_value()) {
    static_cast<PartHeader&>(mesh.part.emplace()) = *header.part;
  }
}

absl::Status MeshCollector::Begin(const MeshHeader& header) {
  header_ = header;
  SetHeader(header, mesh_);
  return absl::OkStatus();
}

absl::Status MeshCollector::AddPoints(std::span<const double> points) {
  mesh_.points.insert(mesh_.points.end(), points.begin(), points.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddMovedVertices(std::span<const uint32_t> vertices) {
  mesh_.moved_vertices.insert(mesh_.moved_vertices.end(), vertices.begin(), vertices.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddWeights(std::span<const double> weights) {
  mesh_.weights.insert(mesh_.weights.end(), weights.begin(), weights.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddSimplices(std::span<const uint32_t> simplices) {
  mesh_.simplices.insert(mesh_.simplices.end(), simplices.begin(), simplices.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddInputVertices(std::span<const uint32_t> vertices) {
  mesh_.input_vertex.insert(mesh_.input_vertex.end(), vertices.begin(), vertices.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddVertexOrigins(std::span<const uint32_t> origins) {
  mesh_.vertex_origins.insert(mesh_.vertex_origins.end(), origins.begin(), origins.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddVertexTags(std::span<const int32_t> tags) {
  mesh_.vertex_tags.insert(mesh_.vertex_tags.end(), tags.begin(), tags.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddSimplexRegions(std::span<const int32_t> regions) {
  mesh_.simplex_regions.insert(mesh_.simplex_regions.end(), regions.begin(), regions.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddFacets(std::span<const uint32_t> facets) {
  mesh_.facets.insert(mesh_.facets.end(), facets.begin(), facets.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddRidges(std::span<const uint32_t> ridges) {
  mesh_.ridges.insert(mesh_.ridges.end(), ridges.begin(), ridges.end());
  return absl::OkStatus();
}

absl::Status MeshCollector::AddPartNumbers(PartNumbers array, std::span<const uint32_t> numbers) {
  MeshPart& part = mesh_.part.value();
  std::vector<uint32_t>* const arrays[] = {&part.vertex_ids,  &part.vertex_owners,  &part.vertex_rows,
                                           &part.simplex_ids, &part.simplex_owners, &part.facet_ids};
  std::vector<uint32_t>& values = *arrays[static_cast<int>(array)];
  values.insert(values.end(), numbers.begin(), numbers.end());
  return absl::OkStatus();
}

}  // namespace wellspace::client
