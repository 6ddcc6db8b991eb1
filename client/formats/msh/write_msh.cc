// Gmsh's MSH: 2.2 in ascii, 4.1 in binary.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/number.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/msh/msh.h"
#include "client/formats/msh/msh_groups.h"
#include "client/formats/periodic_pairs.h"
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The common part of both versions: the order of the sections, and rows put together before they are written. The
// functions of a version are called in this order: WriteNodesHeader; AppendNode for each vertex; ElementsHeader and
// BeginSimplices; WriteSimplex for each simplex; EndSimplices; for each part of the boundary AppendBlock, then
// AppendFacet for each facet; AppendData for each vertex, once for each array of numbers.
class MshWriter : public MeshWriter {
 public:
  absl::Status AddPoints(std::span<const double> points) final {
    BeginNodes();
    pairs_.Add(points);
    NoteSides(points);
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

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) final {
    for (const int32_t region : regions) {
      if (!groups_.entities().contains(region)) {
        return absl::InternalError(absl::StrCat("a mesh got a simplex of region ", region, ", and has no such region"));
      }
    }
    regions_.Add(regions);
    return output_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) final {
    BeginElements();
    const size_t nodes = shape_.simplex_nodes();
    WELLSPACE_RETURN_IF_ERROR(regions_.CheckNext(shape_.has_simplex_regions ? simplices.size() / nodes : 0));
    std::vector<uint32_t> simplex;
    for (; !simplices.empty() && output_.status().ok(); simplices = simplices.subspan(nodes)) {
      const int32_t group = shape_.has_simplex_regions ? regions_.Next() : groups_.first();
      simplex.assign(simplices.begin(), simplices.begin() + nodes);
      if (type() == kMshSecondTetrahedron) {  // Gmsh's last edges are 23 and 13
        std::swap(simplex[8], simplex[9]);
      }
      row_.clear();
      WriteSimplex(simplex, group, ++simplices_, row_);
    }
    return output_.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) final {
    BeginElements();
    EndSimplices();
    const size_t nodes = shape_.facet_nodes();
    for (; !facets.empty() && output_.status().ok(); facets = facets.subspan(nodes)) {
      row_.clear();
      const BoundaryPart& part = walk_.Next();
      if (walk_.is_first()) {
        AppendBlock(part, row_);
      }
      NoteFacet(facets.first(shape_.dimension), part.tag);
      AppendFacet(facets.first(nodes), part.tag, simplices_ + ++facets_, row_);
      output_.Write(row_);
    }
    return output_.status();
  }

  absl::Status Commit() final {
    BeginElements();
    EndSimplices();
    EndSection("$EndElements");
    WELLSPACE_RETURN_IF_ERROR(WritePeriodic());
    WELLSPACE_RETURN_IF_ERROR(output_.status());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_.size(),
                                                     .simplex_regions = regions_.count(),
                                                     .simplices = simplices_,
                                                     .facets = facets_}));
    WriteNodeData("input", [this](uint64_t vertex) { return vertex < shape_.input_vertices ? 1.0 : 0.0; });
    if (shape_.has_weights) {
      WriteNodeData(kMshWeights, [this](uint64_t vertex) { return weights_[vertex]; });
    }
    for (std::string& note : groups_.Notes()) {
      AddNote(std::move(note));
    }
    return output_.Commit();
  }

 protected:
  // One side that is the image of another.
  struct PeriodicLink {
    int axis = 0;
    int32_t entity = 0;
    int32_t master = 0;
    double length = 0;
    uint64_t pairs = 0;

    // Of homogeneous coordinates, row after row.
    std::array<double, 16> Affine() const {
      std::array<double, 16> affine{};
      for (size_t i = 0; i < 4; ++i) {
        affine[5 * i] = 1;
      }
      affine[4 * static_cast<size_t>(axis) + 3] = length;
      return affine;
    }
  };

  MshWriter(OutputFile output, const MeshShape& shape, bool is_binary)
      : shape_(shape), output_(std::move(output)), is_binary_(is_binary) {}

  int32_t type() const { return TypeOf(shape_.dimension + 1); }
  int32_t facet_type() const { return TypeOf(shape_.dimension); }
  uint64_t element_count() const { return shape_.simplex_count + shape_.facet_count(); }

  const MeshShape shape_;
  MshGroups groups_{shape_};
  RegionQueue regions_;
  OutputFile output_;

 private:
  virtual void WriteNodesHeader() = 0;
  // Numbers of nodes and elements start at 1.
  virtual void AppendNode(std::span<const double> point, uint64_t number, std::string& row) const = 0;
  virtual std::string ElementsHeader() const = 0;
  // To be called once, at the end of the header: there is room for simplices.
  virtual void BeginSimplices() {}
  // Writes the next simplex. `row` is empty, and any use may be made of it.
  virtual void WriteSimplex(std::span<const uint32_t> corners, int32_t group, uint64_t number, std::string& row) = 0;
  // All simplices have come; may be called again.
  virtual void EndSimplices() {}
  // The lines before the facets of a part.
  virtual void AppendBlock(const BoundaryPart& /*part*/, std::string& /*row*/) const {}
  virtual void AppendFacet(std::span<const uint32_t> corners, int32_t tag, uint64_t number, std::string& row) const = 0;
  // The section of pairs, without its ends: `links` sides, each followed by its nodes.
  virtual void AppendLinks(size_t links, std::string& row) const = 0;
  // The entities of the high and of the low side, the length of the way between, and how many pairs follow.
  virtual void AppendLink(const PeriodicLink& link, std::string& row) const = 0;
  virtual void AppendPair(uint64_t node, uint64_t master, std::string& row) const = 0;
  virtual void AppendData(uint64_t node, double value, std::string& row) const = 0;

  int32_t TypeOf(int corners) const {
    if (shape_.order == MeshOrder::kSecond) {
      return corners == 2 ? kMshSecondLine : corners == 3 ? kMshSecondTriangle : kMshSecondTetrahedron;
    }
    return corners == 2 ? kMshLine : corners == 3 ? kMshTriangle : kMshTetrahedron;
  }

  // `end`: "$EndNodes" and the like. Behind bytes, it is in a line of its own.
  void EndSection(std::string_view end) {
    output_.Write(absl::StrCat(is_binary_ ? "\n" : "", absl::string_view(end.data(), end.size()), "\n"));
  }

  void BeginNodes() {
    if (!std::exchange(has_nodes_, true)) {
      WriteNodesHeader();
    }
  }

  void BeginElements() {
    if (!std::exchange(has_elements_, true)) {
      BeginNodes();
      EndSection("$EndNodes");
      output_.Write(ElementsHeader());
      BeginSimplices();
    }
  }

  // The sides across periodic axes that vertices are on: a bit for each.
  void NoteSides(std::span<const double> points) {
    for (; !shape_.periodic_axes.empty() && !points.empty(); points = points.subspan(shape_.dimension)) {
      uint8_t on = 0;
      for (const int axis : shape_.periodic_axes) {
        on |= points[axis] == shape_.low[axis] ? SideBit(axis, false) : 0;
        on |= points[axis] == shape_.high[axis] ? SideBit(axis, true) : 0;
      }
      sides_.push_back(on);
    }
  }

  void NoteFacet(std::span<const uint32_t> corners, int32_t tag) {
    if (shape_.periodic_axes.empty()) {
      return;
    }
    uint8_t on = 0xff;
    for (const uint32_t corner : corners) {
      on &= sides_[corner];
    }
    PartSides& part = part_sides_[tag];
    part.of_all &= on;
    part.of_some |= on;
  }

  // The part of the boundary that is one side, and nothing else; none if there is no such part.
  std::optional<int32_t> PartOn(uint8_t side) const {
    std::optional<int32_t> found;
    for (const auto& [tag, part] : part_sides_) {
      if ((part.of_some & side) != 0) {
        if (found.has_value() || (part.of_all & side) == 0) {
          return std::nullopt;
        }
        found = tag;
      }
    }
    return found;
  }

  // The sides are the entities of parts of the boundary.
  absl::Status WritePeriodic() {
    if (shape_.periodic_axes.empty() || shape_.boundary.empty()) {
      AddNote(shape_.periodic_axes.empty()
                  ? ""
                  : "the file has no boundary, and therefore no pairs of vertices across periodic axes");
      return absl::OkStatus();
    }
    row_ = "$Periodic\n";
    AppendLinks(shape_.periodic_axes.size(), row_);
    for (const int axis : shape_.periodic_axes) {
      WELLSPACE_ASSIGN_OR_RETURN(const std::vector<VertexPair> pairs, pairs_.Across(axis));
      const std::optional<int32_t> low = PartOn(SideBit(axis, false));
      const std::optional<int32_t> high = PartOn(SideBit(axis, true));
      if (!low.has_value() || !high.has_value()) {
        return absl::InvalidArgumentError(
            absl::StrCat("periodic axis ", std::string(1, "xyz"[axis]),
                         ": .msh has pairs of parts of the boundary; expected one part on each of the two sides, with "
                         "all facets there and no others; give those facets two markers of their own, or write .npz"));
      }
      AppendLink({.axis = axis,
                  .entity = groups_.part_entities().at(*high),
                  .master = groups_.part_entities().at(*low),
                  .length = shape_.high[axis] - shape_.low[axis],
                  .pairs = pairs.size()},
                 row_);
      for (const auto& [master, node] : pairs) {
        AppendPair(uint64_t{node} + 1, uint64_t{master} + 1, row_);
        output_.Write(row_);
        row_.clear();
      }
    }
    output_.Write(row_);
    EndSection("$EndPeriodic");
    return output_.status();
  }

  static uint8_t SideBit(int axis, bool is_high) { return static_cast<uint8_t>(1 << (2 * axis + (is_high ? 1 : 0))); }

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
    EndSection("$EndNodeData");
  }

  const bool is_binary_;
  bool has_nodes_ = false;     // the section
  bool has_elements_ = false;  // the section
  // The periodic sides that all facets of a part are on, and those that some are on.
  struct PartSides {
    uint8_t of_all = 0xff;
    uint8_t of_some = 0;
  };

  uint64_t vertices_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  PartWalk walk_{shape_.boundary};
  PeriodicPairs pairs_{shape_};
  std::vector<uint8_t> sides_;               // by vertex, where an axis is periodic
  std::map<int32_t, PartSides> part_sides_;  // by tag
  std::vector<double> weights_;
  std::string row_;
};

class Msh22Writer final : public MshWriter {
 public:
  Msh22Writer(OutputFile output, const MeshShape& shape) : MshWriter(std::move(output), shape, false) {}

 private:
  void WriteNodesHeader() override {
    output_.Write(absl::StrCat("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", groups_.PhysicalNames(), "$Nodes\n",
                               shape_.vertex_count, "\n"));
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

  void WriteSimplex(std::span<const uint32_t> corners, int32_t group, uint64_t number, std::string& row) override {
    AppendRow(type(), corners, group, groups_.entities().at(group), number, row);
    output_.Write(row);
  }

  void AppendFacet(std::span<const uint32_t> corners, int32_t tag, uint64_t number, std::string& row) const override {
    AppendRow(facet_type(), corners, tag, groups_.part_entities().at(tag), number, row);
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

  void AppendLinks(size_t links, std::string& row) const override { absl::StrAppend(&row, links, "\n"); }

  void AppendLink(const PeriodicLink& link, std::string& row) const override {
    absl::StrAppend(&row, shape_.dimension - 1, " ", link.entity, " ", link.master, "\nAffine");
    for (const double x : link.Affine()) {
      row += ' ';
      AppendNumber(x, row);
    }
    absl::StrAppend(&row, "\n", link.pairs, "\n");
  }

  void AppendPair(uint64_t node, uint64_t master, std::string& row) const override {
    absl::StrAppend(&row, node, " ", master, "\n");
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
    absl::StrAppend(&text, "\n$EndMeshFormat\n", groups_.PhysicalNames());
    groups_.AppendEntities(text);
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
    uint64_t blocks = shape_.has_simplex_regions ? regions_.Sizes().size() : shape_.simplex_count > 0 ? 1 : 0;
    for (const BoundaryPart& part : shape_.boundary) {
      blocks += part.facets > 0 ? 1 : 0;
    }
    AppendCounts(blocks, element_count(), text);
    if (shape_.simplex_count > 0 && !shape_.has_simplex_regions) {
      AppendBlockOf(type(), text);
      AppendBytes<uint64_t>(shape_.simplex_count, text);
    }
    return text;
  }

  // The file has simplices by their regions: each gets as much room as it needs.
  void BeginSimplices() override {
    uint64_t number = 1;
    for (const auto& [region, simplices] : regions_.Sizes()) {
      RegionBlock& block = blocks_[region];
      for (const int32_t value : {static_cast<int32_t>(shape_.dimension), groups_.entities().at(region), type()}) {
        AppendBytes(value, block.header);
      }
      AppendBytes(simplices, block.header);
      block.next_number = number;
      number += simplices;
      if (output_.IsSeekable()) {
        output_.Write(block.header);
        block.place = output_.size();
        WriteZeros(simplices * (shape_.simplex_nodes() + 1) * sizeof(uint64_t));
      }
    }
  }

  void WriteSimplex(std::span<const uint32_t> corners, int32_t group, uint64_t number, std::string& row) override {
    if (!shape_.has_simplex_regions) {
      AppendElement(corners, number, row);
      output_.Write(row);
      return;
    }
    RegionBlock& block = blocks_.at(group);
    AppendElement(corners, block.next_number++, block.rows);
    if (output_.IsSeekable() && block.rows.size() >= kBlockBytes) {
      PutRows(block);
    }
  }

  void EndSimplices() override {
    for (auto& [group, block] : blocks_) {
      if (output_.IsSeekable()) {
        PutRows(block);
      } else {
        output_.Write(block.header);
        output_.Write(block.rows);
      }
    }
    blocks_.clear();
  }

  void AppendElement(std::span<const uint32_t> corners, uint64_t number, std::string& row) const {
    AppendBytes(number, row);
    for (const uint32_t corner : corners) {
      AppendBytes<uint64_t>(uint64_t{corner} + 1, row);
    }
  }

  void AppendLinks(size_t links, std::string& row) const override { AppendBytes<uint64_t>(links, row); }

  void AppendLink(const PeriodicLink& link, std::string& row) const override {
    for (const int32_t value : {static_cast<int32_t>(shape_.dimension - 1), link.entity, link.master}) {
      AppendBytes(value, row);
    }
    const std::array<double, 16> affine = link.Affine();
    AppendBytes<uint64_t>(affine.size(), row);
    for (const double x : affine) {
      AppendBytes(x, row);
    }
    AppendBytes(link.pairs, row);
  }

  void AppendPair(uint64_t node, uint64_t master, std::string& row) const override {
    AppendBytes(node, row);
    AppendBytes(master, row);
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
    for (const int32_t value :
         {static_cast<int32_t>(shape_.dimension - 1), groups_.part_entities().at(part.tag), facet_type()}) {
      AppendBytes(value, row);
    }
    AppendBytes<uint64_t>(part.facets, row);
  }

  void AppendFacet(std::span<const uint32_t> corners, int32_t, uint64_t number, std::string& row) const override {
    AppendElement(corners, number, row);
  }

  // The dimension and number of the entity of nodes and of a mesh of one region; then the section's third number.
  void AppendBlockOf(int32_t third, std::string& text) const {
    for (const int32_t value :
         {static_cast<int32_t>(shape_.dimension), groups_.entities().at(groups_.first()), third}) {
      AppendBytes(value, text);
    }
  }

  // The simplices of a region.
  struct RegionBlock {
    std::string header;
    std::string rows;  // rows that are not in the file yet; at most kBlockBytes and a row if it can be sought
    uint64_t next_number = 0;
    uint64_t place = 0;  // of the next row, if the file can be sought
  };

  void PutRows(RegionBlock& block) {
    output_.Overwrite(block.place, block.rows);
    block.place += block.rows.size();
    block.rows.clear();
  }

  void WriteZeros(uint64_t bytes) {
    const std::string zeros(std::min(bytes, kBlockBytes), '\0');
    for (; bytes > 0 && output_.status().ok(); bytes -= std::min(bytes, kBlockBytes)) {
      output_.Write(std::string_view(zeros).substr(0, std::min(bytes, kBlockBytes)));
    }
  }

  static constexpr uint64_t kBlockBytes = 1 << 12;
  std::map<int32_t, RegionBlock> blocks_;  // by region; empty: one region
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
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<Writer>(std::move(output), shape);
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
