// TetGen's and Triangle's .node and .ele, and for the boundary .edge or .face, and .poly.
#include <cstdint>
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
#include "client/formats/names.h"
#include "client/formats/regions.h"
#include "client/formats/registry.h"
#include "client/formats/tetgen/tetgen.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The edges whose middles are the nodes behind the corners, as Triangle and TetGen have them with -o2, by their place
// in kElementEdges. The first node of a triangle is opposite of its first corner, and so on.
constexpr uint8_t kEdgesOfTriangle[] = {1, 2, 0};
constexpr uint8_t kEdgesOfTetrahedron[] = {5, 3, 0, 1, 4, 2};

// The files of a mesh. Files of the boundary are there if the mesh has one; the last one for 2-D and 3-D only, and of
// first order: its vertices are all points of .node.
struct TetgenFiles {
  OutputFile nodes;
  OutputFile simplices;
  std::optional<OutputFile> facets{};  // .edge or .face
  std::optional<OutputFile> poly{};
};

class NodeAndEleWriter final : public MeshWriter {
 public:
  NodeAndEleWriter(TetgenFiles files, const MeshShape& shape) : shape_(shape), files_(std::move(files)) {
    files_.nodes.Write(absl::StrCat(shape.has_weights ? absl::StrCat("# ", kWeightsComment, "\n") : "",
                                    shape.vertex_count, " ", shape.dimension, shape.has_weights ? " 1" : " 0",
                                    shape.has_vertex_marks ? " 1\n" : " 0\n"));
    const NameLines parts(shape, NameLines::Of::kParts);
    const NameLines regions(shape, NameLines::Of::kRegions);
    AddNote(parts.ChangesNote());
    AddNote(regions.ChangesNote());
    files_.simplices.Write(regions.Text("# "));
    files_.simplices.Write(
        absl::StrCat(shape.simplex_count, " ", shape.simplex_nodes(), shape.regions.empty() ? " 0\n" : " 1\n"));
    if (!shape.regions.empty()) {
      region_ = absl::StrCat(" ", shape.regions[0].id);
    }
    if (files_.facets.has_value()) {
      files_.facets->Write(absl::StrCat(parts.Text("# "), shape.facet_count(), " 1\n"));
    }
    if (files_.poly.has_value()) {
      files_.poly->Write(absl::StrCat(parts.Text("# "), "0 ", shape.dimension, " 0 1\n", shape.facet_count(), " 1\n"));
    }
  }

  // Weight and tag are on the line of their point: points are kept until these have come.
  absl::Status AddPoints(std::span<const double> points) override {
    if (!shape_.has_weights && !shape_.has_vertex_marks) {
      return WriteVertices(points, {}, {});
    }
    points_.insert(points_.end(), points.begin(), points.end());
    return files_.nodes.status();
  }

  absl::Status AddWeights(std::span<const double> weights) override {
    weights_.insert(weights_.end(), weights.begin(), weights.end());
    return shape_.has_vertex_marks ? files_.nodes.status() : WriteKept(weights.size(), {});
  }

  absl::Status AddVertexTags(std::span<const int32_t> tags) override { return WriteKept(tags.size(), tags); }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    regions_.Add(regions);
    return files_.simplices.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    const size_t nodes = shape_.simplex_nodes();
    WELLSPACE_RETURN_IF_ERROR(regions_.CheckNext(shape_.has_simplex_regions ? simplices.size() / nodes : 0));
    OutputFile& output = files_.simplices;
    for (; !simplices.empty() && output.status().ok(); simplices = simplices.subspan(nodes)) {
      line_.clear();
      AppendNumber(simplices_written_++, line_);
      AppendNodes(simplices.first(nodes), shape_.dimension + 1, line_);
      if (shape_.has_simplex_regions) {
        region_ = absl::StrCat(" ", regions_.Next());
      }
      absl::StrAppend(&line_, region_, "\n");
      output.Write(line_);
    }
    return output.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    if (!files_.facets.has_value()) {
      return absl::InternalError("a mesh without a boundary got facets");
    }
    const size_t nodes = shape_.facet_nodes();
    // Triangle has the ends of edges in .edge with -o2, too.
    const size_t written = shape_.dimension == 2 ? 2 : nodes;
    for (; !facets.empty() && files_.facets->status().ok(); facets = facets.subspan(nodes)) {
      line_.clear();
      AppendNumber(facets_written_++, line_);
      AppendNodes(facets.first(written), shape_.dimension, line_);
      const int32_t tag = walk_.Next().tag;
      absl::StrAppend(&line_, " ", tag, "\n");
      files_.facets->Write(line_);
      if (shape_.dimension == 3) {  // there, a facet is a list of polygons
        line_ = absl::StrCat("1 0 ", tag, "\n3");
        AppendCorners(facets.first(shape_.dimension), line_);
        line_ += '\n';
      }
      if (files_.poly.has_value()) {
        files_.poly->Write(line_);
      }
    }
    return files_.facets->status();
  }

  absl::Status Commit() override {
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_written_,
                                                     .weights = shape_.has_weights ? vertices_written_ : 0,
                                                     .simplex_regions = regions_.count(),
                                                     .simplices = simplices_written_,
                                                     .facets = facets_written_}));
    std::vector<OutputFile*> outputs = {&files_.nodes, &files_.simplices};
    if (files_.facets.has_value()) {
      outputs.push_back(&*files_.facets);
    }
    if (files_.poly.has_value()) {
      files_.poly->Write("0\n");  // holes
      outputs.push_back(&*files_.poly);
    }
    // No file appears before all are written.
    for (OutputFile* output : outputs) {
      WELLSPACE_RETURN_IF_ERROR(output->Flush());
    }
    for (OutputFile* output : outputs) {
      WELLSPACE_RETURN_IF_ERROR(output->Commit());
    }
    return absl::OkStatus();
  }

 private:
  // The nodes of an element of `corners` corners.
  static void AppendNodes(std::span<const uint32_t> nodes, size_t corners, std::string& line) {
    AppendCorners(nodes.first(corners), line);
    const std::span<const uint32_t> middles = nodes.subspan(corners);
    const uint8_t* const edges = corners == 3 ? kEdgesOfTriangle : kEdgesOfTetrahedron;
    for (size_t i = 0; i < middles.size(); ++i) {
      AppendCorners(middles.subspan(edges[i], 1), line);
    }
  }

  static void AppendCorners(std::span<const uint32_t> corners, std::string& line) {
    for (const uint32_t corner : corners) {
      line += ' ';
      AppendNumber(uint64_t{corner}, line);
    }
  }

  // The next `count` of the vertices that are kept.
  absl::Status WriteKept(uint64_t count, std::span<const int32_t> tags) {
    const uint64_t first = vertices_written_ * shape_.dimension;
    if (first + count * shape_.dimension > points_.size() ||
        (shape_.has_weights && vertices_written_ + count > weights_.size())) {
      return absl::InternalError(absl::StrCat("a mesh got ", vertices_written_ + count, " weights or tags, ",
                                              weights_.size(), " weights and ", points_.size() / shape_.dimension,
                                              " points"));
    }
    return WriteVertices(
        std::span<const double>(points_).subspan(first, count * shape_.dimension),
        shape_.has_weights ? std::span<const double>(weights_).subspan(vertices_written_, count) : std::span<double>(),
        tags);
  }

  // The next vertices, each with its weight and its tag unless there are none.
  absl::Status WriteVertices(std::span<const double> points, std::span<const double> weights,
                             std::span<const int32_t> tags) {
    OutputFile& output = files_.nodes;
    for (size_t i = 0; i * shape_.dimension < points.size() && output.status().ok(); ++i) {
      line_.clear();
      AppendNumber(vertices_written_++, line_);
      for (const double x : points.subspan(i * shape_.dimension, shape_.dimension)) {
        line_ += ' ';
        AppendNumber(x, line_);
      }
      if (!weights.empty()) {
        line_ += ' ';
        AppendNumber(weights[i], line_);
      }
      if (!tags.empty()) {
        absl::StrAppend(&line_, " ", tags[i]);
      }
      line_ += '\n';
      output.Write(line_);
    }
    return output.status();
  }

  const MeshShape shape_;
  TetgenFiles files_;
  std::string region_;  // the end of the line of a simplex
  PartWalk walk_{shape_.boundary};
  RegionQueue regions_;
  uint64_t vertices_written_ = 0;
  uint64_t simplices_written_ = 0;
  uint64_t facets_written_ = 0;
  std::vector<double> points_;   // with weights or tags: all
  std::vector<double> weights_;  // all
  std::string line_;
};

}  // namespace

std::string WithExtension(const std::string& path, const std::string& extension) {
  return path.substr(0, path.size() - ExtensionOf(path).size()) + extension;
}

std::vector<std::string> BoundaryFilesOf(const std::string& path, int dimension) {
  std::vector<std::string> files = {WithExtension(path, dimension == 2 ? ".edge" : ".face")};
  if (dimension <= 3) {
    files.push_back(WithExtension(path, ".poly"));
  }
  return files;
}

std::vector<std::string> TetgenFilesOf(const std::string& path) {
  std::vector<std::string> files;
  for (const char* extension : {".node", ".ele", ".edge", ".face", ".poly"}) {
    files.push_back(WithExtension(path, extension));
  }
  return files;
}

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateNodeAndEle(const std::string& path, const MeshShape& shape,
                                                             std::stop_token stop) {
  std::vector<std::string> names = {WithExtension(path, ".node"), WithExtension(path, ".ele")};
  if (!shape.boundary.empty()) {
    std::vector<std::string> of_boundary = BoundaryFilesOf(path, shape.dimension);
    if (shape.order == MeshOrder::kSecond) {
      of_boundary.resize(1);
    }
    names.insert(names.end(), of_boundary.begin(), of_boundary.end());
  }
  std::vector<OutputFile> outputs;
  for (const std::string& name : names) {
    WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(name, stop));
    outputs.push_back(std::move(output));
  }
  TetgenFiles files{.nodes = std::move(outputs[0]), .simplices = std::move(outputs[1])};
  if (outputs.size() > 2) {
    files.facets.emplace(std::move(outputs[2]));
  }
  if (outputs.size() > 3) {
    files.poly.emplace(std::move(outputs[3]));
  }
  return std::make_unique<NodeAndEleWriter>(std::move(files), shape);
}

}  // namespace wellspace::formats
