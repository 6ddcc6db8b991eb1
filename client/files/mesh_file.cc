#include "client/files/mesh_file.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

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

formats::Mesh ToFormats(Mesh mesh) {
  formats::Mesh converted{.dimension = mesh.dimension,
                          .points = std::move(mesh.points),
                          .simplices = std::move(mesh.simplices),
                          .weights = std::move(mesh.weights),
                          .vertex_origins = std::move(mesh.vertex_origins),
                          .vertex_tags = std::move(mesh.vertex_tags),
                          .facets = std::move(mesh.facets),
                          .ridges = std::move(mesh.ridges),
                          .simplex_regions = std::move(mesh.simplex_regions)};
  for (BoundaryPart& part : mesh.boundary) {
    converted.boundary.push_back({part.tag, std::move(part.name), part.facet_count});
  }
  for (Region& region : mesh.regions) {
    converted.regions.push_back({region.id, std::move(region.name)});
  }
  return converted;
}

absl::Status WritePart(Mesh part, const std::string& path, const std::string& format, std::stop_token stop,
                       std::vector<std::string>* notes) {
  const MeshPart numbers = *std::exchange(part.part, std::nullopt);
  const formats::PartNumbers of_file{.part = numbers.part,
                                     .parts = numbers.parts,
                                     .own_vertices = numbers.own_vertex_count,
                                     .own_simplices = numbers.own_simplex_count,
                                     .whole_simplices = numbers.whole_simplex_count,
                                     .vertex_ids = numbers.vertex_ids,
                                     .vertex_owners = numbers.vertex_owners,
                                     .vertex_rows = numbers.vertex_rows,
                                     .simplex_ids = numbers.simplex_ids,
                                     .simplex_owners = numbers.simplex_owners,
                                     .facet_ids = numbers.facet_ids};
  const formats::Mesh mesh = ToFormats(std::move(part));
  formats::MeshView view = mesh.View();
  view.part = &of_file;
  return formats::WriteMesh(path, format, view, stop, notes);
}

void NameParts(const std::map<int32_t, std::string>& names, std::vector<BoundaryPart>& boundary) {
  for (BoundaryPart& part : boundary) {
    const auto named = names.find(part.tag);
    // Parts without a marker have the tags that no marker has.
    if (named != names.end() && part.name == absl::StrCat("marker_", part.tag)) {
      part.name = named->second;
    }
  }
}

absl::Status MeshFile::Begin(const MeshHeader& header) {
  if (header.part.has_value()) {  // its numbers come last, and have their place in the middle of files
    return absl::InvalidArgumentError("a part of a mesh is collected by a MeshCollector, and written by WritePart");
  }
  header_ = header;
  client::NameParts(part_names_, header_.boundary);
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
