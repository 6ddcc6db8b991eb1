// Gmsh's MSH: 2.2 in ascii, 4.1 in binary.
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/msh.h"
#include "client/formats/number.h"
#include "client/formats/output_file.h"

namespace wellspace::formats {
namespace {

template <typename T>
void AppendBytes(T value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

// What both versions share: the order of the sections, and rows put together before they are written.
class MshWriter : public MeshWriter {
 public:
  absl::Status AddPoints(std::span<const double> points) final {
    BeginNodes();
    for (; !points.empty() && output_.status().ok(); points = points.subspan(shape_.dimension)) {
      row_.clear();
      AppendNode(points.first(shape_.dimension), ++vertices_, row_);
      output_.Write(row_);
    }
    return output_.status();
  }

  // Gmsh looks for data after the elements only: weights are kept until then.
  absl::Status AddWeights(std::span<const double> weights) final {
    weights_.insert(weights_.end(), weights.begin(), weights.end());
    return output_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) final {
    BeginElements();
    const size_t corners = shape_.dimension + 1;
    for (; !simplices.empty() && output_.status().ok(); simplices = simplices.subspan(corners)) {
      row_.clear();
      AppendElement(simplices.first(corners), ++simplices_, row_);
      output_.Write(row_);
    }
    return output_.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) final {
    BeginElements();
    for (; !facets.empty() && output_.status().ok(); facets = facets.subspan(shape_.dimension)) {
      row_.clear();
      const BoundaryPart& part = walk_.Next();
      if (walk_.is_first()) {
        AppendBlock(part, row_);
      }
      AppendFacet(facets.first(shape_.dimension), part.tag, simplices_ + ++facets_, row_);
      output_.Write(row_);
    }
    return output_.status();
  }

  absl::Status Commit() final {
    BeginElements();
    output_.Write(is_binary_ ? "\n$EndElements\n" : "$EndElements\n");
    if (absl::Status status = output_.status(); !status.ok()) {
      return status;
    }
    if (absl::Status status = CheckComplete(shape_, vertices_, weights_.size(), simplices_, facets_); !status.ok()) {
      return status;
    }
    WriteNodeData("input", [this](uint64_t vertex) { return vertex < shape_.input_vertices ? 1.0 : 0.0; });
    if (shape_.has_weights) {
      WriteNodeData(kMshWeights, [this](uint64_t vertex) { return weights_[vertex]; });
    }
    return output_.Commit();
  }

 protected:
  MshWriter(OutputFile output, const MeshShape& shape, bool is_binary)
      : shape_(shape), output_(std::move(output)), is_binary_(is_binary) {}

  int type() const { return shape_.dimension == 2 ? kMshTriangle : kMshTetrahedron; }
  int facet_type() const { return shape_.dimension == 2 ? kMshLine : kMshTriangle; }
  uint64_t element_count() const { return shape_.simplex_count + shape_.facet_count(); }

  // The physical group of the simplices. There are readers that tell groups by their numbers alone, whatever their
  // dimensions: it is none of the boundary's.
  int32_t Group() const {
    std::set<int32_t> taken;
    for (const BoundaryPart& part : shape_.boundary) {
      taken.insert(part.tag);
    }
    int32_t group = 1;
    while (taken.contains(group)) {
      ++group;
    }
    return group;
  }

  // The section with the names of groups, if there are any.
  std::string PhysicalNames() const {
    if (shape_.boundary.empty()) {
      return "";
    }
    std::string text = absl::StrCat("$PhysicalNames\n", shape_.boundary.size() + 1, "\n");
    for (const BoundaryPart& part : shape_.boundary) {
      absl::StrAppend(&text, shape_.dimension - 1, " ", part.tag, " \"", part.name, "\"\n");
    }
    absl::StrAppend(&text, shape_.dimension, " ", group_, " \"",
                    shape_.regions.empty() ? "domain" : shape_.regions[0].name, "\"\n$EndPhysicalNames\n");
    return text;
  }

  const MeshShape shape_;
  const int32_t group_ = Group();  // of the simplices
  OutputFile output_;

 private:
  virtual void WriteNodesHeader() = 0;
  // Numbers of nodes and elements start at 1.
  virtual void AppendNode(std::span<const double> point, uint64_t number, std::string& row) const = 0;
  virtual std::string ElementsHeader() const = 0;
  virtual void AppendElement(std::span<const uint32_t> corners, uint64_t number, std::string& row) const = 0;
  // What goes before the facets of a part.
  virtual void AppendBlock(const BoundaryPart& /*part*/, std::string& /*row*/) const {}
  virtual void AppendFacet(std::span<const uint32_t> corners, int32_t tag, uint64_t number, std::string& row) const = 0;
  virtual void AppendData(uint64_t node, double value, std::string& row) const = 0;

  void BeginNodes() {
    if (!std::exchange(has_nodes_, true)) {
      WriteNodesHeader();
    }
  }

  void BeginElements() {
    if (!std::exchange(has_elements_, true)) {
      BeginNodes();
      output_.Write(is_binary_ ? "\n$EndNodes\n" : "$EndNodes\n");
      output_.Write(ElementsHeader());
    }
  }

  // One text, the name; one number, the time; four whole numbers: the step, numbers in a value, values, the partition.
  template <typename Value>
  void WriteNodeData(std::string_view name, Value value) {
    output_.Write(absl::StrCat("$NodeData\n1\n\"", absl::string_view(name.data(), name.size()), "\"\n1\n0\n4\n0\n1\n",
                               shape_.vertex_count, "\n0\n"));
    for (uint64_t vertex = 0; vertex < shape_.vertex_count && output_.status().ok(); ++vertex) {
      row_.clear();
      AppendData(vertex + 1, value(vertex), row_);
      output_.Write(row_);
    }
    output_.Write(is_binary_ ? "\n$EndNodeData\n" : "$EndNodeData\n");
  }

  const bool is_binary_;
  bool has_nodes_ = false;     // the section
  bool has_elements_ = false;  // the section
  uint64_t vertices_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  PartWalk walk_{shape_.boundary};
  std::vector<double> weights_;
  std::string row_;
};

class Msh22Writer final : public MshWriter {
 public:
  Msh22Writer(OutputFile output, const MeshShape& shape) : MshWriter(std::move(output), shape, false) {}

 private:
  void WriteNodesHeader() override {
    output_.Write(
        absl::StrCat("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", PhysicalNames(), "$Nodes\n", shape_.vertex_count, "\n"));
  }

  void AppendNode(std::span<const double> point, uint64_t number, std::string& row) const override {
    AppendNumber(number, row);
    for (const double x : point) {
      row += ' ';
      AppendNumber(x, row);
    }
    row += point.size() == 2 ? " 0\n" : "\n";
  }

  std::string ElementsHeader() const override { return absl::StrCat("$Elements\n", element_count(), "\n"); }

  void AppendElement(std::span<const uint32_t> corners, uint64_t number, std::string& row) const override {
    AppendRow(type(), corners, group_, kMshEntity, number, row);
  }

  void AppendFacet(std::span<const uint32_t> corners, int32_t tag, uint64_t number, std::string& row) const override {
    AppendRow(facet_type(), corners, tag, tag, number, row);
  }

  // Two tags: the physical group and the geometric entity.
  static void AppendRow(int type, std::span<const uint32_t> corners, int32_t group, int32_t entity, uint64_t number,
                        std::string& row) {
    absl::StrAppend(&row, number, " ", type, " 2 ", group, " ", entity);
    for (const uint32_t corner : corners) {
      row += ' ';
      AppendNumber(uint64_t{corner} + 1, row);
    }
    row += '\n';
  }

  void AppendData(uint64_t node, double value, std::string& row) const override {
    AppendNumber(node, row);
    row += ' ';
    AppendNumber(value, row);
    row += '\n';
  }
};

class Msh41Writer final : public MshWriter {
 public:
  Msh41Writer(OutputFile output, const MeshShape& shape) : MshWriter(std::move(output), shape, true) {}

 private:
  // One block of one entity; all numbers of nodes, then all coordinates. Words are of the machine's order, as the
  // integer 1 tells.
  void WriteNodesHeader() override {
    std::string text = "$MeshFormat\n4.1 1 8\n";
    AppendBytes<int32_t>(1, text);
    absl::StrAppend(&text, "\n$EndMeshFormat\n", PhysicalNames());
    AppendEntities(text);
    text += "$Nodes\n";
    AppendCounts(shape_.vertex_count > 0 ? 1 : 0, shape_.vertex_count, text);
    if (shape_.vertex_count > 0) {
      AppendBlockOf(0, text);
      AppendBytes<uint64_t>(shape_.vertex_count, text);
    }
    output_.Write(text);
    for (uint64_t node = 1; node <= shape_.vertex_count && output_.status().ok(); ++node) {
      text.clear();
      AppendBytes(node, text);
      output_.Write(text);
    }
  }

  void AppendNode(std::span<const double> point, uint64_t, std::string& row) const override {
    for (const double x : point) {
      AppendBytes(x, row);
    }
    if (point.size() == 2) {
      AppendBytes(0.0, row);
    }
  }

  std::string ElementsHeader() const override {
    std::string text = "$Elements\n";
    uint64_t blocks = shape_.simplex_count > 0 ? 1 : 0;
    for (const BoundaryPart& part : shape_.boundary) {
      blocks += part.facets > 0 ? 1 : 0;
    }
    AppendCounts(blocks, element_count(), text);
    if (shape_.simplex_count > 0) {
      AppendBlockOf(type(), text);
      AppendBytes<uint64_t>(shape_.simplex_count, text);
    }
    return text;
  }

  void AppendElement(std::span<const uint32_t> corners, uint64_t number, std::string& row) const override {
    AppendBytes(number, row);
    for (const uint32_t corner : corners) {
      AppendBytes<uint64_t>(uint64_t{corner} + 1, row);
    }
  }

  void AppendData(uint64_t node, double value, std::string& row) const override {
    AppendBytes(static_cast<int32_t>(node), row);
    AppendBytes(value, row);
  }

  // Of blocks, of rows, the first and the last number.
  static void AppendCounts(uint64_t blocks, uint64_t rows, std::string& text) {
    for (const uint64_t value : {blocks, rows, rows > 0 ? uint64_t{1} : uint64_t{0}, rows}) {
      AppendBytes(value, text);
    }
  }

  void AppendBlock(const BoundaryPart& part, std::string& row) const override {
    for (const int32_t value : {static_cast<int32_t>(shape_.dimension - 1), part.tag, facet_type()}) {
      AppendBytes(value, row);
    }
    AppendBytes<uint64_t>(part.facets, row);
  }

  void AppendFacet(std::span<const uint32_t> corners, int32_t, uint64_t number, std::string& row) const override {
    AppendElement(corners, number, row);
  }

  // Points, curves, surfaces, volumes: of each its number, its bounding box, its groups, and what bounds it. Every part
  // of the boundary is an entity with its number; the bounding box of all is that of the mesh.
  void AppendEntities(std::string& text) const {
    if (shape_.boundary.empty()) {
      return;
    }
    text += "$Entities\n";
    for (int dimension = 0; dimension <= 3; ++dimension) {
      AppendBytes<uint64_t>(dimension == shape_.dimension       ? 1
                            : dimension == shape_.dimension - 1 ? shape_.boundary.size()
                                                                : 0,
                            text);
    }
    for (const BoundaryPart& part : shape_.boundary) {
      AppendEntity(part.tag, part.tag, text);
      AppendBytes<uint64_t>(0, text);
    }
    AppendEntity(kMshEntity, group_, text);
    AppendBytes<uint64_t>(shape_.boundary.size(), text);
    for (const BoundaryPart& part : shape_.boundary) {
      AppendBytes(part.tag, text);
    }
    text += "\n$EndEntities\n";
  }

  void AppendEntity(int32_t number, int32_t group, std::string& text) const {
    AppendBytes(number, text);
    for (const std::vector<double>* corner : {&shape_.low, &shape_.high}) {
      for (size_t axis = 0; axis < 3; ++axis) {
        AppendBytes(axis < corner->size() ? (*corner)[axis] : 0.0, text);
      }
    }
    AppendBytes<uint64_t>(1, text);
    AppendBytes(group, text);
  }

  // The entity's dimension and number; then what the section has third.
  void AppendBlockOf(int32_t third, std::string& text) const {
    for (const int32_t value : {static_cast<int32_t>(shape_.dimension), kMshEntity, third}) {
      AppendBytes(value, text);
    }
  }
};

template <typename Writer>
absl::StatusOr<std::unique_ptr<MeshWriter>> Create(const std::string& path, const MeshShape& shape,
                                                   std::stop_token stop) {
  constexpr uint64_t kMaxVertices = std::numeric_limits<int32_t>::max();
  if (shape.vertex_count > kMaxVertices) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": MSH numbers at most ", kMaxVertices,
                                                   " vertices, and this mesh has ", shape.vertex_count,
                                                   "; expected vtu or npz"));
  }
  absl::StatusOr<OutputFile> output = OutputFile::Create(path, std::move(stop));
  if (!output.ok()) {
    return output.status();
  }
  return std::make_unique<Writer>(*std::move(output), shape);
}

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMsh22(const std::string& path, const MeshShape& shape,
                                                        std::stop_token stop) {
  return Create<Msh22Writer>(path, shape, std::move(stop));
}

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMsh41(const std::string& path, const MeshShape& shape,
                                                        std::stop_token stop) {
  return Create<Msh41Writer>(path, shape, std::move(stop));
}

}  // namespace wellspace::formats
