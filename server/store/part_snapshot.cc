#include "server/store/part_snapshot.h"

#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/memory/huge_pages.h"
#include "core/base/status_macros.h"
#include "server/wire/convert.h"

namespace wellspace::server {
namespace {

// The metadata of a part, made of those of the whole mesh. `facets`: of each part of the boundary.
void DescribePart(const core::Mesh& whole, const PartSnapshot::Cut& cut, const core::MeshPart& part, bool with_boundary,
                  v1::MeshMetadata& metadata) {
  metadata.set_vertex_count(part.vertices.size());
  metadata.set_simplex_count(part.simplices.size());
  metadata.set_input_point_count(0);
  metadata.set_moved_vertex_count(0);
  metadata.set_ridge_count(0);
  if (with_boundary) {
    std::vector<uint64_t> counts;
    for (const v1::BoundaryPart& of_boundary : metadata.boundary()) {
      counts.push_back(of_boundary.facet_count());
    }
    counts = core::CountInRuns(counts, part.facets);
    for (int i = 0; i < metadata.boundary_size(); ++i) {
      metadata.mutable_boundary(i)->set_facet_count(counts[i]);
    }
    metadata.set_facet_count(part.facets.size());
  }
  if (metadata.statistics().has_slivers()) {  // they name vertices by their numbers in the whole mesh
    metadata.mutable_statistics()->mutable_slivers()->clear_flattest_left();
  }
  v1::MeshPartInfo& info = *metadata.mutable_part();
  info.set_parts(cut.parts);
  info.set_part(cut.part);
  info.set_own_vertex_count(part.own_vertices);
  info.set_own_simplex_count(part.own_simplices);
  info.set_whole_vertex_count(whole.vertex_count());
  info.set_whole_simplex_count(whole.simplex_count());
  info.set_whole_facet_count(whole.facet_count());
}

}  // namespace

absl::StatusOr<std::shared_ptr<PartSnapshot>> PartSnapshot::Make(const core::Mesh& whole, const Cut& cut,
                                                                 core::MeshPart part, v1::MeshMetadata metadata,
                                                                 bool with_boundary, const core::RunContext& context) {
  DescribePart(whole, cut, part, with_boundary, metadata);
  core::Mesh mesh;
  mesh.dimension = whole.dimension;
  PartArrays numbers;
  const auto take = [&](const auto& values, const core::HugeVector<uint32_t>& rows, size_t width, auto& taken) {
    return core::TakeRows(values, rows, width, context, taken);
  };
  const auto& [vertices, simplices] = std::tie(part.vertices, part.simplices);
  WELLSPACE_RETURN_IF_ERROR(take(whole.points, vertices, whole.dimension, mesh.points));
  WELLSPACE_RETURN_IF_ERROR(take(whole.weights, vertices, 1, mesh.weights));
  if (with_boundary) {
    WELLSPACE_RETURN_IF_ERROR(take(whole.vertex_origins, vertices, 1, mesh.vertex_origins));
    WELLSPACE_RETURN_IF_ERROR(take(whole.vertex_tags, vertices, 1, mesh.vertex_tags));
    WELLSPACE_RETURN_IF_ERROR(take(whole.simplex_regions, simplices, 1, mesh.simplex_regions));
  }
  WELLSPACE_RETURN_IF_ERROR(take(cut.owners.of_vertices, vertices, 1, numbers.vertex_owners));
  WELLSPACE_RETURN_IF_ERROR(take(cut.owners.rows, vertices, 1, numbers.vertex_rows));
  WELLSPACE_RETURN_IF_ERROR(take(cut.mesh.part_of, simplices, 1, numbers.simplex_owners));
  mesh.simplices = std::move(part.simplex_corners);
  mesh.facets = std::move(part.facet_corners);
  numbers.vertex_ids = std::move(part.vertices);
  numbers.simplex_ids = std::move(part.simplices);
  numbers.facet_ids = std::move(part.facets);
  auto chunks = std::make_shared<MeshChunks>(std::move(mesh), std::move(numbers));
  metadata.set_chunk_count(chunks->count(with_boundary));
  return std::shared_ptr<PartSnapshot>(new PartSnapshot(std::move(metadata), std::move(chunks), with_boundary));
}

uint64_t PartSnapshot::BytesFor(const core::Mesh& whole, const core::PartSelection& selection) {
  // Points and weights, origins and tags, owners and rows; regions and owners.
  const uint64_t of_vertex = sizeof(double) * (whole.dimension + 1) + 4 * sizeof(uint32_t);
  const uint64_t of_simplex = 2 * sizeof(uint32_t);
  return of_vertex * selection.vertices + of_simplex * selection.simplices + MeshChunks::kBytesOnTheirWay;
}

}  // namespace wellspace::server
