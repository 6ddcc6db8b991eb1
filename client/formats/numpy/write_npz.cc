// numpy's .npz: a mesh as arrays.
#include <array>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/middle_nodes.h"
#include "client/formats/numpy/npz.h"
#include "client/formats/numpy/npz_file.h"
#include "client/formats/periodic_pairs.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kValuesAtOnce = 1 << 14;

class NpzWriter final : public MeshWriter {
 public:
  NpzWriter(std::unique_ptr<NpzFile> file, const MeshShape& shape) : shape_(shape), file_(std::move(file)) {
    file_->Begin<double>(kNpzPoints, shape_.vertex_count, shape_.dimension);
  }

  absl::Status AddPoints(std::span<const double> points) override {
    file_->Write(points);
    pairs_.Add(points);
    vertices_ += points.size() / shape_.dimension;
    return file_->status();
  }

  absl::Status AddWeights(std::span<const double> weights) override {
    BeginWeights();
    file_->Write(weights);
    weights_ += weights.size();
    return file_->status();
  }

  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override {
    if (!std::exchange(has_origins_, true)) {
      file_->Begin<int64_t>(kNpzOrigins, shape_.vertex_count);
    }
    std::vector<int64_t> values;
    for (const uint32_t origin : origins) {
      values.push_back(SignedOrigin(origin));
    }
    file_->Write(std::span<const int64_t>(values));
    return file_->status();
  }

  absl::Status AddVertexTags(std::span<const int32_t> tags) override {
    if (!std::exchange(has_vertex_tags_, true)) {
      file_->Begin<int32_t>(kNpzVertexTags, shape_.vertex_count);
    }
    file_->Write(tags);
    return file_->status();
  }

  absl::Status AddAttribute(size_t index, std::span<const double> values) override {
    if (attributes_begun_ == index) {
      ++attributes_begun_;
      file_->Begin<double>(absl::StrCat("attribute_", shape_.attributes[index], ".npy"), shape_.vertex_count);
    }
    file_->Write(values);
    attribute_values_ += values.size();
    return file_->status();
  }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    if (!std::exchange(has_simplex_regions_, true)) {
      file_->Begin<int32_t>(kNpzRegions, shape_.simplex_count);
    }
    file_->Write(regions);
    simplex_regions_ += regions.size();
    return file_->status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    BeginSimplices();
    BeginFacets();
    file_->Write(facets);
    facets_ += facets.size() / shape_.facet_nodes();
    return file_->status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginSimplices();
    file_->Write(simplices);
    simplices_ += simplices.size() / shape_.simplex_nodes();
    return file_->status();
  }

  absl::Status AddRidges(std::span<const uint32_t> ridges) override {
    if (!std::exchange(has_ridges_, true)) {
      file_->Begin<uint32_t>(kNpzRidges, shape_.ridge_count, 2);
    }
    file_->Write(ridges);
    ridges_ += ridges.size() / 2;
    return file_->status();
  }

  absl::Status Commit() override {
    BeginSimplices();
    if (!shape_.boundary.empty()) {
      BeginFacets();
      WriteTags();
    }
    if (!shape_.regions.empty()) {
      WriteRegions();
    }
    if (shape_.part != nullptr) {
      WritePart(*shape_.part);
    }
    if (shape_.middles != nullptr) {
      WELLSPACE_RETURN_IF_ERROR(WriteMiddles(*shape_.middles));
    }
    WELLSPACE_RETURN_IF_ERROR(WritePairs());
    AddNote(file_->ChangesNote());
    WELLSPACE_RETURN_IF_ERROR(file_->status());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_,
                                                     .simplex_regions = simplex_regions_,
                                                     .simplices = simplices_,
                                                     .facets = facets_,
                                                     .attribute_values = attribute_values_,
                                                     .ridges = ridges_}));
    return file_->Commit();
  }

 private:
  void BeginWeights() {
    if (!std::exchange(has_weights_, true)) {
      file_->Begin<double>(kNpzWeights, shape_.vertex_count);
    }
  }

  void BeginSimplices() {
    if (!std::exchange(has_simplices_, true)) {
      file_->Begin<uint32_t>(kNpzSimplices, shape_.simplex_count, shape_.simplex_nodes());
    }
  }

  void BeginFacets() {
    if (!std::exchange(has_facets_, true)) {
      file_->Begin<uint32_t>(kNpzFacets, shape_.facet_count(), shape_.facet_nodes());
    }
  }

  // The data of facets beside the indices.
  void WriteTags() {
    std::vector<int32_t> tags;
    std::vector<std::string> names;
    file_->Begin<int32_t>(kNpzFacetTags, shape_.facet_count());
    for (const BoundaryPart& part : shape_.boundary) {
      file_->WriteRepeated(part.tag, part.facets);
      tags.push_back(part.tag);
      names.push_back(part.name);
    }
    file_->WriteTexts(kNpzFacetNames, names);
    file_->WriteArray(kNpzFacetNameTags, std::span<const int32_t>(tags));
  }

  // Of the only region also the number, for each simplex.
  void WriteRegions() {
    if (!shape_.has_simplex_regions) {
      file_->Begin<int32_t>(kNpzRegions, shape_.simplex_count);
      file_->WriteRepeated(shape_.regions[0].id, shape_.simplex_count);
    }
    std::vector<int32_t> ids;
    std::vector<std::string> names;
    for (const Region& region : shape_.regions) {
      ids.push_back(region.id);
      names.push_back(region.name);
    }
    file_->WriteArray(kNpzRegionIds, std::span<const int32_t>(ids));
    file_->WriteTexts(kNpzRegionNames, names);
  }

  absl::Status WritePairs() {
    for (const int axis : shape_.periodic_axes) {
      WELLSPACE_ASSIGN_OR_RETURN(const std::vector<VertexPair> pairs, pairs_.Across(axis));
      file_->Begin<uint32_t>(kNpzPeriodic[axis], pairs.size(), 2);
      for (const VertexPair& pair : pairs) {
        file_->Write(std::span<const uint32_t>(pair));
      }
    }
    return file_->status();
  }

  absl::Status WriteMiddles(const MiddleNodes& middles) {
    file_->Begin<uint32_t>(kNpzMiddleEnds, middles.count(), 2);
    std::vector<uint32_t> ends;
    const auto flush = [&] {
      file_->Write(std::span<const uint32_t>(ends));
      ends.clear();
      return file_->status();
    };
    WELLSPACE_RETURN_IF_ERROR(middles.ForEachEdge([&](uint32_t low, uint32_t high) {
      ends.insert(ends.end(), {low, high});
      return ends.size() < kValuesAtOnce ? absl::OkStatus() : flush();
    }));
    return flush();
  }

  void WritePart(const PartNumbers& part) {
    const std::array<uint64_t, 4> numbers = {part.part, part.parts, part.own_vertices, part.own_simplices};
    file_->Begin<uint64_t>(kNpzPart, numbers.size());
    file_->Write(std::span<const uint64_t>(numbers));
    for (const auto& [member, values] : {std::pair(kNpzVertexIds, part.vertex_ids),
                                         {kNpzVertexOwners, part.vertex_owners},
                                         {kNpzVertexRows, part.vertex_rows},
                                         {kNpzSimplexIds, part.simplex_ids},
                                         {kNpzSimplexOwners, part.simplex_owners},
                                         {kNpzFacetIds, part.facet_ids}}) {
      file_->Begin<uint32_t>(member, values.size());
      file_->Write(values);
    }
  }

  const MeshShape shape_;
  const std::unique_ptr<NpzFile> file_;
  PeriodicPairs pairs_{shape_};
  bool has_weights_ = false;    // the member
  bool has_simplices_ = false;  // the member
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplices_ = 0;
  bool has_origins_ = false;  // the member; also the following
  bool has_vertex_tags_ = false;
  bool has_simplex_regions_ = false;
  bool has_facets_ = false;
  bool has_ridges_ = false;
  size_t attributes_begun_ = 0;  // members
  uint64_t simplex_regions_ = 0;
  uint64_t facets_ = 0;
  uint64_t ridges_ = 0;
  uint64_t attribute_values_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateNpz(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<NpzFile> file, NpzFile::Create(path, std::move(stop)));
  return std::make_unique<NpzWriter>(std::move(file), shape);
}

}  // namespace wellspace::formats
