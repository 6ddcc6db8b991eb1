#include "client/formats/mesh_rows.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/middle_nodes.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kRowsAtOnce = 1 << 12;

absl::Status CancelledWriting(const std::string& path) {
  return absl::CancelledError(absl::StrCat("cancelled while writing ", path));
}

// INTERNAL unless `mesh` is of the shape.
absl::Status CheckShape(const MeshView& mesh, const MeshShape& shape) {
  uint64_t attribute_values = 0;
  for (const Attribute& attribute : mesh.attributes) {
    attribute_values += attribute.values.size();
  }
  return CheckComplete(shape, {.vertices = mesh.vertex_count(),
                               .weights = mesh.weights.size(),
                               .simplex_regions = mesh.simplex_regions.size(),
                               .simplices = mesh.simplex_count(),
                               .facets = mesh.facets.size() / shape.dimension,
                               .attribute_values = attribute_values,
                               .ridges = mesh.ridges.size() / 2});
}

// Rows of numbers on their way to a writer, in blocks.
template <typename T, typename Write>
class RowBlocks {
 public:
  // `width` numbers are a row.
  RowBlocks(size_t width, Write write) : size_(width * kRowsAtOnce), write_(std::move(write)) { block_.reserve(size_); }

  // The next number; blocks are written at the ends of rows.
  absl::Status Add(T value) {
    block_.push_back(value);
    return block_.size() < size_ ? absl::OkStatus() : End();
  }

  absl::Status End() {
    const absl::Status status = block_.empty() ? absl::OkStatus() : write_(std::span<const T>(block_));
    block_.clear();
    return status;
  }

 private:
  const size_t size_;
  Write write_;
  std::vector<T> block_;
};

// The rows of a mesh, and of the middle nodes if there are such.
class RowsOfMesh {
 public:
  RowsOfMesh(const MeshView& mesh, const MiddleNodes* middles, MeshWriter& writer)
      : mesh_(mesh), middles_(middles), writer_(writer) {}

  absl::Status Write() {
    WELLSPACE_RETURN_IF_ERROR(WriteVertices());
    if (!mesh_.simplex_regions.empty()) {
      WELLSPACE_RETURN_IF_ERROR(writer_.AddSimplexRegions(mesh_.simplex_regions));
    }
    WELLSPACE_RETURN_IF_ERROR(
        WriteElements(mesh_.simplices, mesh_.dimension + 1,
                      [this](std::span<const uint32_t> rows) { return writer_.AddSimplices(rows); }));
    if (!mesh_.facets.empty()) {
      WELLSPACE_RETURN_IF_ERROR(WriteElements(
          mesh_.facets, mesh_.dimension, [this](std::span<const uint32_t> rows) { return writer_.AddFacets(rows); }));
    }
    return mesh_.ridges.empty() ? absl::OkStatus() : writer_.AddRidges(mesh_.ridges);
  }

 private:
  absl::Status WriteVertices() {
    const auto add_points = [this](std::span<const double> points) { return writer_.AddPoints(points); };
    const auto add_weights = [this](std::span<const double> weights) { return writer_.AddWeights(weights); };
    WELLSPACE_RETURN_IF_ERROR(WriteNumbers(mesh_.points, mesh_.dimension, add_points));
    if (!mesh_.weights.empty()) {
      WELLSPACE_RETURN_IF_ERROR(WriteNumbers(mesh_.weights, 1, add_weights));
    }
    if (!mesh_.vertex_tags.empty()) {
      WELLSPACE_RETURN_IF_ERROR(WriteMarks());
    }
    for (size_t i = 0; i < mesh_.attributes.size(); ++i) {
      const auto add = [&](std::span<const double> values) { return writer_.AddAttribute(i, values); };
      WELLSPACE_RETURN_IF_ERROR(WriteNumbers(mesh_.attributes[i].values, 1, add));
    }
    return absl::OkStatus();
  }

  // `width` numbers of each vertex, then of each middle node.
  template <typename Add>
  absl::Status WriteNumbers(std::span<const double> values, size_t width, Add add) {
    WELLSPACE_RETURN_IF_ERROR(add(values));
    if (middles_ == nullptr) {
      return absl::OkStatus();
    }
    RowBlocks<double, Add> blocks(width, add);
    const auto add_middle = [&](uint32_t low, uint32_t high) {
      for (size_t i = 0; i < width; ++i) {
        // Of huge ends, too, the middle is a number.
        WELLSPACE_RETURN_IF_ERROR(blocks.Add(std::midpoint(values[low * width + i], values[high * width + i])));
      }
      return absl::OkStatus();
    };
    WELLSPACE_RETURN_IF_ERROR(middles_->ForEachEdge(add_middle));
    return blocks.End();
  }

  absl::Status WriteMarks() {
    WELLSPACE_RETURN_IF_ERROR(writer_.AddVertexOrigins(mesh_.vertex_origins));
    const uint64_t count = middles_ == nullptr ? 0 : middles_->count();
    const std::vector<uint32_t> origins(std::min<uint64_t>(count, kRowsAtOnce), kMiddleOrigin);
    for (uint64_t done = 0; done < count; done += kRowsAtOnce) {
      const auto block = std::span(origins).first(std::min<uint64_t>(count - done, kRowsAtOnce));
      WELLSPACE_RETURN_IF_ERROR(writer_.AddVertexOrigins(block));
    }
    WELLSPACE_RETURN_IF_ERROR(writer_.AddVertexTags(mesh_.vertex_tags));
    return count == 0 ? absl::OkStatus() : writer_.AddVertexTags(TagsOfMiddles());
  }

  // An edge between two vertices of the boundary may be inside: facets tell.
  std::vector<int32_t> TagsOfMiddles() const {
    std::vector<int32_t> tags(middles_->count());
    PartWalk walk(mesh_.boundary);
    const size_t corners = mesh_.dimension;
    for (std::span<const uint32_t> facets = mesh_.facets; !facets.empty(); facets = facets.subspan(corners)) {
      const int32_t facet_tag = walk.Next().tag;
      for (size_t edge = 0; edge < corners * (corners - 1) / 2; ++edge) {
        int32_t& tag = tags[MiddleOf(facets, edge) - mesh_.vertex_count()];
        tag = tag == 0 ? facet_tag : std::min(tag, facet_tag);
      }
    }
    return tags;
  }

  uint32_t MiddleOf(std::span<const uint32_t> element, size_t edge) const {
    return middles_->NodeOf(element[kElementEdges[edge][0]], element[kElementEdges[edge][1]]);
  }

  template <typename Add>
  absl::Status WriteElements(std::span<const uint32_t> elements, size_t corners, Add add) {
    if (middles_ == nullptr) {
      return add(elements);
    }
    RowBlocks<uint32_t, Add> blocks(NodesOf(static_cast<int>(corners), MeshOrder::kSecond), add);
    for (; !elements.empty(); elements = elements.subspan(corners)) {
      for (size_t corner = 0; corner < corners; ++corner) {
        WELLSPACE_RETURN_IF_ERROR(blocks.Add(elements[corner]));
      }
      for (size_t edge = 0; edge < corners * (corners - 1) / 2; ++edge) {
        WELLSPACE_RETURN_IF_ERROR(blocks.Add(MiddleOf(elements, edge)));
      }
    }
    return blocks.End();
  }

  const MeshView& mesh_;
  const MiddleNodes* const middles_;  // null: first order
  MeshWriter& writer_;
};

// Keeps a mesh until it is complete: the number of nodes stands before the first of them.
class SecondOrderWriter final : public MeshWriter {
 public:
  SecondOrderWriter(std::string path, const MeshShape& shape, CreateWriter create, std::stop_token stop)
      : path_(std::move(path)), shape_(shape), create_(create), stop_(std::move(stop)) {
    mesh_.dimension = shape_.dimension;
    for (const std::string& name : shape_.attributes) {
      attributes_.push_back({.name = name, .values = {}});
    }
  }

  absl::Status AddPoints(std::span<const double> points) override { return Keep(points, mesh_.points); }
  absl::Status AddWeights(std::span<const double> weights) override { return Keep(weights, mesh_.weights); }
  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override {
    return Keep(origins, mesh_.vertex_origins);
  }
  absl::Status AddVertexTags(std::span<const int32_t> tags) override { return Keep(tags, mesh_.vertex_tags); }
  absl::Status AddAttribute(size_t index, std::span<const double> values) override {
    return index < attributes_.size() ? Keep(values, attributes_[index].values) : absl::OkStatus();
  }
  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    return Keep(regions, mesh_.simplex_regions);
  }
  absl::Status AddSimplices(std::span<const uint32_t> simplices) override { return Keep(simplices, mesh_.simplices); }
  absl::Status AddFacets(std::span<const uint32_t> facets) override { return Keep(facets, mesh_.facets); }
  absl::Status AddRidges(std::span<const uint32_t> ridges) override {
    return shape_.ridge_count > 0 ? Keep(ridges, mesh_.ridges) : absl::OkStatus();
  }

  absl::Status Commit() override {
    MeshView view = mesh_.View();
    view.boundary = shape_.boundary;
    view.regions = shape_.regions;
    view.attributes = attributes_;
    std::vector<std::string> more_notes;
    const absl::Status status = WriteSecondOrder(view, shape_, path_, create_, stop_, more_notes);
    for (std::string& note : more_notes) {
      AddNote(std::move(note));
    }
    return status;
  }

 private:
  template <typename T>
  absl::Status Keep(std::span<const T> values, std::vector<T>& kept) {
    kept.insert(kept.end(), values.begin(), values.end());
    return stop_.stop_requested() ? CancelledWriting(path_) : absl::OkStatus();
  }

  const std::string path_;
  const MeshShape shape_;
  const CreateWriter create_;
  const std::stop_token stop_;
  Mesh mesh_;  // of first order, without boundary and regions, which the shape has
  std::vector<Attribute> attributes_;
};

}  // namespace

absl::Status WriteRows(const MeshView& mesh, MeshWriter& writer) {
  WELLSPACE_RETURN_IF_ERROR(RowsOfMesh(mesh, nullptr, writer).Write());
  return writer.Commit();
}

absl::Status WriteSecondOrder(const MeshView& mesh, const MeshShape& shape, const std::string& path,
                              CreateWriter create, const std::stop_token& stop, std::vector<std::string>& notes) {
  WELLSPACE_RETURN_IF_ERROR(CheckShape(mesh, shape));
  WELLSPACE_ASSIGN_OR_RETURN(const MiddleNodes middles, MiddleNodes::Of(mesh, stop));
  MeshShape with_middles = shape;
  with_middles.vertex_count += middles.count();
  with_middles.middles = &middles;
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<MeshWriter> writer, create(path, with_middles, stop));
  WELLSPACE_RETURN_IF_ERROR(RowsOfMesh(mesh, &middles, *writer).Write());
  WELLSPACE_RETURN_IF_ERROR(writer->Commit());
  notes.insert(notes.end(), writer->notes().begin(), writer->notes().end());
  return absl::OkStatus();
}

std::unique_ptr<MeshWriter> CreateSecondOrder(const std::string& path, const MeshShape& shape, CreateWriter create,
                                              std::stop_token stop) {
  return std::make_unique<SecondOrderWriter>(path, shape, create, std::move(stop));
}

}  // namespace wellspace::formats
