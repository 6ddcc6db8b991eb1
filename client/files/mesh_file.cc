#include "client/files/mesh_file.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

constexpr size_t kValuesAtOnce = 1 << 14;

// How many vertices, the first of a mesh, are input points. Of a surface few are, and how many is not told.
uint64_t InputVerticesOf(const MeshStatistics& statistics) {
  if (statistics.surface.has_value()) {
    return 0;
  }
  const uint64_t unmeshed = statistics.domain.has_value() ? statistics.domain->unmeshed_points : 0;
  return statistics.input_points - statistics.duplicates - statistics.merged_points - unmeshed;
}

}  // namespace

absl::Status MeshFile::Begin(const MeshHeader& header) {
  header_ = header;
  for (BoundaryPart& part : header_.boundary) {
    const auto named = part_names_.find(part.tag);
    // Parts without a marker have the tags that no marker has.
    if (named != part_names_.end() && part.name == absl::StrCat("marker_", part.tag)) {
      part.name = named->second;
    }
  }
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
      .periodic_axes = periodic_axes_,
      .ridge_count = header.ridge_count,
      .order = order_,
  };
  for (const BoundaryPart& part : header_.boundary) {
    shape.boundary.push_back({part.tag, part.name, part.facet_count});
  }
  if (header.has_vertex_marks && formats::HasPlaceForAttributes(path_, format_)) {
    shape.attributes = formats::NamesToWrite(attributes_);
  }
  has_attributes_ = !shape.attributes.empty();
  origins_.clear();
  tagged_vertices_ = 0;
  for (const Region& region : header.regions) {
    shape.regions.push_back({region.id, region.name});
  }
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<formats::MeshWriter> writer,
                             formats::CreateMesh(path_, format_, shape, stop_));
  writer_ = std::move(writer);
  return absl::OkStatus();
}

absl::Status MeshFile::AddVertexOrigins(std::span<const uint32_t> origins) {
  if (has_attributes_) {
    origins_.insert(origins_.end(), origins.begin(), origins.end());
  }
  return writer_->AddVertexOrigins(origins);
}

absl::Status MeshFile::AddVertexTags(std::span<const int32_t> tags) {
  WELLSPACE_RETURN_IF_ERROR(writer_->AddVertexTags(tags));
  tagged_vertices_ += tags.size();
  return has_attributes_ && tagged_vertices_ == header_.vertex_count ? WriteAttributes() : absl::OkStatus();
}

absl::Status MeshFile::WriteAttributes() {
  std::vector<double> values;
  for (size_t i = 0; i < attributes_.size(); ++i) {
    const std::vector<double>& of_points = attributes_[i].values;
    for (size_t first = 0; first < origins_.size(); first += kValuesAtOnce) {
      values.clear();
      for (size_t vertex = first; vertex < std::min(origins_.size(), first + kValuesAtOnce); ++vertex) {
        const uint32_t origin = origins_[vertex];
        values.push_back(origin < of_points.size() ? of_points[origin] : std::numeric_limits<double>::quiet_NaN());
      }
      WELLSPACE_RETURN_IF_ERROR(writer_->AddAttribute(i, values));
    }
  }
  origins_ = {};
  return absl::OkStatus();
}

absl::Status MeshFile::AddInputVertices(std::span<const uint32_t> vertices) {
  if (keeps_input_vertices_) {
    input_vertex_.insert(input_vertex_.end(), vertices.begin(), vertices.end());
  }
  return absl::OkStatus();
}

}  // namespace wellspace::client
