#include "client/formats/hydro/hydro_writer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/formats/hydro/facet_chains.h"
#include "client/formats/io/number.h"
#include "client/formats/mesh_writers.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

HydroWriter::HydroWriter(OutputFile output, const MeshShape& shape, const Height& height, Strings strings)
    : shape_(shape),
      height_(height),
      strings_(strings),
      output_(std::move(output)),
      height_index_(shape.attributes.size()) {
  const auto find = [this](const char* name) {
    return std::find(shape_.attributes.begin(), shape_.attributes.end(), name) - shape_.attributes.begin();
  };
  height_index_ = find(height_.name);
  if (height_index_ == shape_.attributes.size()) {
    height_index_ = find(height_.opposite);
    is_opposite_ = true;
  }
  std::vector<std::string> others = shape_.attributes;
  if (height_index_ < others.size()) {
    others.erase(others.begin() + static_cast<ptrdiff_t>(height_index_));
  }
  if (!others.empty()) {
    AddNote(
        absl::StrCat("the format has a place for one attribute of vertices; left out: ", absl::StrJoin(others, ", ")));
  }
}

absl::Status HydroWriter::AddPoints(std::span<const double> points) {
  points_.insert(points_.end(), points.begin(), points.end());
  return output_.status();
}

absl::Status HydroWriter::AddWeights(std::span<const double> /*weights*/) {
  return absl::InternalError("a mesh without weights got some");
}

absl::Status HydroWriter::AddVertexTags(std::span<const int32_t> tags) {
  for (const int32_t tag : tags) {
    is_tagged_.push_back(tag != 0 ? 1 : 0);
  }
  return output_.status();
}

absl::Status HydroWriter::AddAttribute(size_t index, std::span<const double> values) {
  attribute_values_ += values.size();
  if (index == height_index_) {
    heights_.insert(heights_.end(), values.begin(), values.end());
  }
  return output_.status();
}

absl::Status HydroWriter::AddSimplexRegions(std::span<const int32_t> regions) {
  regions_.Add(regions);
  return output_.status();
}

std::string HydroWriter::HeightOf(uint64_t node) {
  const double height = node < heights_.size() ? heights_[node] : NAN;
  if (!std::isfinite(height)) {
    ++missing_heights_;
    return height_.missing;
  }
  std::string text;
  AppendNumber(is_opposite_ && height != 0 ? -height : height, text);
  return text;
}

void HydroWriter::WriteNodes() {
  if (std::exchange(has_nodes_, true)) {
    return;
  }
  output_.Write(Start());
  for (uint64_t node = 0; node < points_.size() / 2 && output_.status().ok(); ++node) {
    line_.clear();
    const std::string height = height_index_ < shape_.attributes.size() ? HeightOf(node) : "0";
    AppendNode(node + 1, PointOf(static_cast<uint32_t>(node)), height, line_);
    output_.Write(line_);
  }
}

absl::Status HydroWriter::AddSimplices(std::span<const uint32_t> simplices) {
  WriteNodes();
  constexpr size_t kCorners = 3;
  WELLSPACE_RETURN_IF_ERROR(regions_.CheckNext(shape_.has_simplex_regions ? simplices.size() / kCorners : 0));
  const int32_t only_region = shape_.regions.empty() ? 1 : shape_.regions[0].id;
  for (; !simplices.empty() && output_.status().ok(); simplices = simplices.subspan(kCorners)) {
    line_.clear();
    for (size_t i = 0; strings_ == Strings::kOutside && !shape_.boundary.empty() && i < kCorners; ++i) {
      const uint32_t p = simplices[i];
      const uint32_t q = simplices[(i + 1) % kCorners];
      if (is_tagged_.empty() || (is_tagged_[p] != 0 && is_tagged_[q] != 0)) {
        edges_.emplace_back(std::min(p, q), std::max(p, q));
      }
    }
    AppendTriangle(++simplices_, simplices.first(kCorners), shape_.has_simplex_regions ? regions_.Next() : only_region,
                   line_);
    output_.Write(line_);
  }
  return output_.status();
}

absl::Status HydroWriter::AddFacets(std::span<const uint32_t> facets) {
  facets_.insert(facets_.end(), facets.begin(), facets.end());
  return output_.status();
}

std::vector<uint32_t> HydroWriter::TakeFacets(std::span<const uint32_t> facets) {
  std::vector<uint32_t> taken;
  for (; !facets.empty(); facets = facets.subspan(2)) {
    const std::pair<uint32_t, uint32_t> edge(std::min(facets[0], facets[1]), std::max(facets[0], facets[1]));
    const auto [begin, end] = std::equal_range(edges_.begin(), edges_.end(), edge);
    if (end - begin > 1) {
      ++inner_edges_;
    } else {
      taken.insert(taken.end(), {facets[0], facets[1]});
    }
  }
  return taken;
}

absl::Status HydroWriter::Commit() {
  WriteNodes();
  WELLSPACE_RETURN_IF_ERROR(output_.status());
  WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = points_.size() / 2,
                                                   .weights = 0,
                                                   .simplex_regions = regions_.count(),
                                                   .simplices = simplices_,
                                                   .facets = facets_.size() / 2,
                                                   .attribute_values = attribute_values_}));
  std::sort(edges_.begin(), edges_.end());
  std::vector<NodeString> strings;
  std::span<const uint32_t> left = facets_;
  for (const BoundaryPart& part : shape_.boundary) {
    for (std::vector<uint32_t>& nodes : ChainsOf(TakeFacets(left.first(2 * part.facets)))) {
      strings.push_back({&part, std::move(nodes)});
    }
    left = left.subspan(2 * part.facets);
  }
  End(strings);
  if (inner_edges_ > 0) {
    AddNote(absl::StrCat("the format has boundaries outside alone: ", inner_edges_,
                         inner_edges_ == 1 ? " edge between two triangles is" : " edges between two triangles are",
                         " left out"));
  }
  if (height_index_ == shape_.attributes.size()) {
    AddNote(absl::StrCat("no attribute of the points is called ", height_.name, " or ", height_.opposite,
                         ": all nodes have the ", height_.name, " 0"));
  } else if (missing_heights_ > 0) {
    AddNote(absl::StrCat(missing_heights_, missing_heights_ == 1 ? " node is" : " nodes are", " without a ",
                         height_.name, ", which points alone have: written as ", height_.missing));
  }
  WELLSPACE_RETURN_IF_ERROR(output_.status());
  return output_.Commit();
}

}  // namespace wellspace::formats
