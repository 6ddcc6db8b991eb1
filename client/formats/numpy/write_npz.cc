// numpy's .npz: a mesh as arrays.
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "client/formats/numpy/npy.h"
#include "client/formats/numpy/npz.h"
#include "client/formats/numpy/zip_file.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class NpzWriter final : public MeshWriter {
 public:
  NpzWriter(OutputFile output, const MeshShape& shape) : shape_(shape), output_(std::move(output)), archive_(output_) {
    Begin(kNpzPoints, "<f8", shape_.vertex_count, shape_.dimension, sizeof(double));
  }

  absl::Status AddPoints(std::span<const double> points) override {
    Write(points);
    vertices_ += points.size() / shape_.dimension;
    return archive_.status();
  }

  absl::Status AddWeights(std::span<const double> weights) override {
    BeginWeights();
    Write(weights);
    weights_ += weights.size();
    return archive_.status();
  }

  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override {
    if (!std::exchange(has_origins_, true)) {
      Begin(kNpzOrigins, "<i8", shape_.vertex_count, std::nullopt, sizeof(int64_t));
    }
    std::vector<int64_t> values;
    for (const uint32_t origin : origins) {
      values.push_back(SignedOrigin(origin));
    }
    Write(std::span<const int64_t>(values));
    return archive_.status();
  }

  absl::Status AddVertexTags(std::span<const int32_t> tags) override {
    if (!std::exchange(has_vertex_tags_, true)) {
      Begin(kNpzVertexTags, "<i4", shape_.vertex_count, std::nullopt, sizeof(int32_t));
    }
    Write(tags);
    return archive_.status();
  }

  absl::Status AddAttribute(size_t index, std::span<const double> values) override {
    if (attributes_begun_ == index) {
      ++attributes_begun_;
      Begin(absl::StrCat("attribute_", shape_.attributes[index], ".npy").c_str(), "<f8", shape_.vertex_count,
            std::nullopt, sizeof(double));
    }
    Write(values);
    attribute_values_ += values.size();
    return archive_.status();
  }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    if (!std::exchange(has_simplex_regions_, true)) {
      Begin(kNpzRegions, "<i4", shape_.simplex_count, std::nullopt, sizeof(int32_t));
    }
    Write(regions);
    simplex_regions_ += regions.size();
    return archive_.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    BeginSimplices();
    BeginFacets();
    Write(facets);
    facets_ += facets.size() / shape_.dimension;
    return archive_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginSimplices();
    Write(simplices);
    simplices_ += simplices.size() / (shape_.dimension + 1);
    return archive_.status();
  }

  absl::Status AddRidges(std::span<const uint32_t> ridges) override {
    if (!std::exchange(has_ridges_, true)) {
      Begin(kNpzRidges, "<u4", shape_.ridge_count, 2, sizeof(uint32_t));
    }
    Write(ridges);
    ridges_ += ridges.size() / 2;
    return archive_.status();
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
    AddNote(changes_.Note(absl::StrCat("names are text of at most ", kMaxNpyCharacters, " characters")));
    WELLSPACE_RETURN_IF_ERROR(archive_.Finish());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_,
                                                     .simplex_regions = simplex_regions_,
                                                     .simplices = simplices_,
                                                     .facets = facets_,
                                                     .attribute_values = attribute_values_,
                                                     .ridges = ridges_}));
    return output_.Commit();
  }

 private:
  void Begin(const char* member, const char* type, uint64_t rows, std::optional<uint64_t> columns, size_t value_bytes) {
    const std::string preamble = NpyPreamble(type, rows, columns);
    archive_.Begin(member, preamble.size() + rows * columns.value_or(1) * value_bytes);
    archive_.Write(preamble);
  }

  void BeginWeights() {
    if (!std::exchange(has_weights_, true)) {
      Begin(kNpzWeights, "<f8", shape_.vertex_count, std::nullopt, sizeof(double));
    }
  }

  void BeginSimplices() {
    if (!std::exchange(has_simplices_, true)) {
      Begin(kNpzSimplices, "<u4", shape_.simplex_count, shape_.dimension + 1, sizeof(uint32_t));
    }
  }

  void BeginFacets() {
    if (!std::exchange(has_facets_, true)) {
      Begin(kNpzFacets, "<u4", shape_.facet_count(), shape_.dimension, sizeof(uint32_t));
    }
  }

  // The data of facets beside the indices.
  void WriteTags() {
    std::vector<int32_t> tags;
    std::vector<std::string> names;
    Begin(kNpzFacetTags, "<i4", shape_.facet_count(), std::nullopt, sizeof(int32_t));
    for (const BoundaryPart& part : shape_.boundary) {
      WriteRepeated(part.tag, part.facets);
      tags.push_back(part.tag);
      names.push_back(part.name);
    }
    WriteNames(kNpzFacetNames, names);
    WriteNumbers(kNpzFacetNameTags, tags);
  }

  // Of the only region also the number, for each simplex.
  void WriteRegions() {
    if (!shape_.has_simplex_regions) {
      Begin(kNpzRegions, "<i4", shape_.simplex_count, std::nullopt, sizeof(int32_t));
      WriteRepeated(shape_.regions[0].id, shape_.simplex_count);
    }
    std::vector<int32_t> ids;
    std::vector<std::string> names;
    for (const Region& region : shape_.regions) {
      ids.push_back(region.id);
      names.push_back(region.name);
    }
    WriteNumbers(kNpzRegionIds, ids);
    WriteNames(kNpzRegionNames, names);
  }

  void WritePart(const PartNumbers& part) {
    const std::array<uint64_t, 4> numbers = {part.part, part.parts, part.own_vertices, part.own_simplices};
    Begin(kNpzPart, "<u8", numbers.size(), std::nullopt, sizeof(uint64_t));
    Write(std::span<const uint64_t>(numbers));
    for (const auto& [member, values] : {std::pair(kNpzVertexIds, part.vertex_ids),
                                         {kNpzVertexOwners, part.vertex_owners},
                                         {kNpzVertexRows, part.vertex_rows},
                                         {kNpzSimplexIds, part.simplex_ids},
                                         {kNpzSimplexOwners, part.simplex_owners},
                                         {kNpzFacetIds, part.facet_ids}}) {
      Begin(member, "<u4", values.size(), std::nullopt, sizeof(uint32_t));
      Write(values);
    }
  }

  void WriteNumbers(const char* member, std::span<const int32_t> numbers) {
    Begin(member, "<i4", numbers.size(), std::nullopt, sizeof(int32_t));
    Write(numbers);
  }

  void WriteNames(const char* member, std::span<const std::string> names) {
    size_t longest = 1;
    std::vector<std::u32string> texts;
    for (const std::string& name : names) {
      std::u32string& text = texts.emplace_back(ToUtf32(name));
      text.resize(std::min<size_t>(text.size(), kMaxNpyCharacters));
      longest = std::max(longest, text.size());
      changes_.Add(name, ToUtf8(text));
    }
    Begin(member, absl::StrCat("<U", longest).c_str(), names.size(), std::nullopt, longest * sizeof(char32_t));
    for (std::u32string& letters : texts) {
      letters.resize(longest, U'\0');
      Write(std::span<const char32_t>(letters));
    }
  }

  void WriteRepeated(int32_t value, uint64_t count) {
    constexpr uint64_t kBlock = 1 << 14;
    const std::vector<int32_t> block(std::min(count, kBlock), value);
    for (uint64_t done = 0; done < count && archive_.status().ok(); done += kBlock) {
      Write(std::span<const int32_t>(block).first(std::min(count - done, kBlock)));
    }
  }

  template <typename T>
  void Write(std::span<const T> values) {
    archive_.Write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  }

  const MeshShape shape_;
  OutputFile output_;
  ZipWriter archive_;
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
  NameChanges changes_;
  uint64_t facets_ = 0;
  uint64_t ridges_ = 0;
  uint64_t attribute_values_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateNpz(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  if (!output.IsSeekable()) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": npz is a zip archive, which needs a regular file"));
  }
  return std::make_unique<NpzWriter>(std::move(output), shape);
}

}  // namespace wellspace::formats
