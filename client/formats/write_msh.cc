// Gmsh's MSH: 2.2 in ascii, 4.1 in binary.
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
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

  absl::Status Commit() final {
    BeginElements();
    output_.Write(is_binary_ ? "\n$EndElements\n" : "$EndElements\n");
    if (absl::Status status = output_.status(); !status.ok()) {
      return status;
    }
    if (absl::Status status = CheckComplete(shape_, vertices_, weights_.size(), simplices_); !status.ok()) {
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

  const MeshShape shape_;
  OutputFile output_;

 private:
  virtual void WriteNodesHeader() = 0;
  // Numbers of nodes and elements start at 1.
  virtual void AppendNode(std::span<const double> point, uint64_t number, std::string& row) const = 0;
  virtual std::string ElementsHeader() const = 0;
  virtual void AppendElement(std::span<const uint32_t> corners, uint64_t number, std::string& row) const = 0;
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
  std::vector<double> weights_;
  std::string row_;
};

class Msh22Writer final : public MshWriter {
 public:
  Msh22Writer(OutputFile output, const MeshShape& shape) : MshWriter(std::move(output), shape, false) {}

 private:
  void WriteNodesHeader() override {
    output_.Write(absl::StrCat("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n", shape_.vertex_count, "\n"));
  }

  void AppendNode(std::span<const double> point, uint64_t number, std::string& row) const override {
    AppendNumber(number, row);
    for (const double x : point) {
      row += ' ';
      AppendNumber(x, row);
    }
    row += point.size() == 2 ? " 0\n" : "\n";
  }

  std::string ElementsHeader() const override { return absl::StrCat("$Elements\n", shape_.simplex_count, "\n"); }

  // Two tags: the physical group and the geometric entity, both 1.
  void AppendElement(std::span<const uint32_t> corners, uint64_t number, std::string& row) const override {
    AppendNumber(number, row);
    row += shape_.dimension == 2 ? " 2 2 1 1" : " 4 2 1 1";
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
    text += "\n$EndMeshFormat\n$Nodes\n";
    AppendCounts(shape_.vertex_count, text);
    if (shape_.vertex_count > 0) {
      AppendEntity(0, text);
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
    AppendCounts(shape_.simplex_count, text);
    if (shape_.simplex_count > 0) {
      AppendEntity(type(), text);
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
  static void AppendCounts(uint64_t count, std::string& text) {
    const uint64_t any = count > 0 ? 1 : 0;
    for (const uint64_t value : {any, count, any, count}) {
      AppendBytes(value, text);
    }
  }

  // The entity's dimension and number; then what the section has third.
  void AppendEntity(int32_t third, std::string& text) const {
    for (const int32_t value : {static_cast<int32_t>(shape_.dimension), int32_t{1}, third}) {
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
