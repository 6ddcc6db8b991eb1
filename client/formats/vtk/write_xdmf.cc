// XDMF 3, with its arrays in HDF5: https://www.xdmf.org/index.php/XDMF_Model_and_Format.
//
// The boundary is a pair of files of its own: meshio reads one grid of a file, dolfinx cells of one kind of a grid, and
// arrays from the file whose name is that of the XDMF alone.
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/vtk/hdf_file.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/xml_scanner.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The attributes of an array in XDMF: its kind of numbers, and bytes of each.
constexpr char kXdmfDouble[] = "NumberType=\"Float\" Precision=\"8\"";
constexpr char kXdmfInt64[] = "NumberType=\"Int\" Precision=\"8\"";
constexpr char kXdmfInt32[] = "NumberType=\"Int\" Precision=\"4\"";
constexpr char kXdmfByte[] = "NumberType=\"UChar\" Precision=\"1\"";

// A grid, and its arrays.
struct XdmfPair {
  OutputFile grid;
  OutputFile heavy;
  std::string heavy_name{};  // as the grid refers to it
};

class XdmfWriter final : public MeshWriter {
 public:
  // `boundary` is there if the shape has one.
  XdmfWriter(XdmfPair mesh, std::optional<XdmfPair> boundary, const MeshShape& shape, std::stop_token stop)
      : shape_(shape), mesh_(std::move(mesh)), boundary_(std::move(boundary)) {
    const std::lock_guard lock(Hdf5Mutex());
    file_.emplace(mesh_.heavy.temporary_path(), stop);
    file_->AddArray<uint8_t>(file_->file(), "input", shape_.vertex_count,
                             [this](uint64_t vertex) { return vertex < shape_.input_vertices ? 1 : 0; });
    if (!shape_.has_simplex_regions && !shape_.regions.empty()) {
      file_->AddArray<int32_t>(file_->file(), kVtkRegion, shape_.simplex_count,
                               [this](uint64_t) { return shape_.regions[0].id; });
    }
    if (boundary_.has_value()) {
      boundary_file_.emplace(boundary_->heavy.temporary_path(), std::move(stop));
      PartWalk walk(shape_.boundary);
      boundary_file_->AddArray<int32_t>(boundary_file_->file(), "facet_tags", shape_.facet_count(),
                                        [&walk](uint64_t) { return walk.Next().tag; });
      boundary_file_->BeginArray<int64_t>(boundary_file_->file(), "facets", shape_.facet_count(), shape_.facet_nodes());
    }
    file_->BeginArray<double>(file_->file(), "points", shape_.vertex_count, shape_.dimension);
    array_ = "points";
  }

  ~XdmfWriter() override {
    const std::lock_guard lock(Hdf5Mutex());
    file_.reset();
    boundary_file_.reset();
  }

  absl::Status AddPoints(std::span<const double> points) override {
    vertices_ += points.size() / shape_.dimension;
    return Add<double>("points", shape_.vertex_count, shape_.dimension, points);
  }
  absl::Status AddWeights(std::span<const double> weights) override {
    weights_ += weights.size();
    return Add<double>("weights", shape_.vertex_count, 1, weights);
  }
  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override {
    std::vector<int64_t> values;
    ForEachBlock(origins, 1, [&](std::span<const uint32_t> block) {
      values.clear();
      for (const uint32_t origin : block) {
        values.push_back(SignedOrigin(origin));
      }
      Add<int64_t>(kVtkOrigin, shape_.vertex_count, 1, values).IgnoreError();  // it is kept
    });
    return file_->status();
  }
  absl::Status AddVertexTags(std::span<const int32_t> tags) override {
    return Add<int32_t>(kVtkBoundary, shape_.vertex_count, 1, tags);
  }
  absl::Status AddAttribute(size_t index, std::span<const double> values) override {
    attribute_values_ += values.size();
    return Add<double>(ArrayOfAttribute(index), shape_.vertex_count, 1, values);
  }
  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    simplex_regions_ += regions.size();
    return Add<int32_t>(kVtkRegion, shape_.simplex_count, 1, regions);
  }
  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    simplices_ += simplices.size() / shape_.simplex_nodes();
    BeginSimplices();
    return AddCells(*file_, shape_.simplex_nodes(), simplices);
  }
  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    if (!boundary_file_.has_value()) {
      return absl::InternalError("a mesh without a boundary got facets");
    }
    facets_ += facets.size() / shape_.facet_nodes();
    return AddCells(*boundary_file_, shape_.facet_nodes(), facets);
  }

  absl::Status Commit() override {
    BeginSimplices();
    {
      const std::lock_guard lock(Hdf5Mutex());
      WELLSPACE_RETURN_IF_ERROR(file_->Finish());
      if (boundary_file_.has_value()) {
        WELLSPACE_RETURN_IF_ERROR(boundary_file_->Finish());
      }
    }
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_,
                                                     .simplex_regions = simplex_regions_,
                                                     .simplices = simplices_,
                                                     .facets = facets_,
                                                     .attribute_values = attribute_values_}));
    // No file appears before all are written, and arrays before the file that refers to them.
    std::vector<OutputFile*> outputs;
    WriteMeshGrid();
    if (boundary_.has_value()) {
      WriteBoundaryGrid();
      outputs = {&boundary_->heavy, &boundary_->grid};
    }
    outputs.insert(outputs.begin(), &mesh_.heavy);
    outputs.push_back(&mesh_.grid);
    for (OutputFile* output : outputs) {
      WELLSPACE_RETURN_IF_ERROR(output->Flush());
    }
    for (OutputFile* output : outputs) {
      WELLSPACE_RETURN_IF_ERROR(output->Commit());
    }
    return absl::OkStatus();
  }

 private:
  // The next rows of the array `name`, which is begun with the first.
  template <typename T>
  absl::Status Add(const std::string& name, uint64_t rows, uint64_t columns, std::span<const T> values) {
    const std::lock_guard lock(Hdf5Mutex());
    if (array_ != name) {
      file_->BeginArray<T>(file_->file(), name.c_str(), rows, columns);
      array_ = name;
    }
    file_->Add<T>(values);
    return file_->status();
  }

  void BeginSimplices() {
    // An array without rows is one, too.
    Add<int64_t>("simplices", shape_.simplex_count, shape_.simplex_nodes(), {}).IgnoreError();  // it is kept
  }

  // The next rows of the array of `file` that has been begun.
  static absl::Status AddCells(HdfFile& file, uint64_t columns, std::span<const uint32_t> vertices) {
    const std::lock_guard lock(Hdf5Mutex());
    std::vector<int64_t> indices;
    ForEachBlock(vertices, columns, [&](std::span<const uint32_t> block) {
      indices.assign(block.begin(), block.end());
      file.Add<int64_t>(indices);
    });
    return file.status();
  }

  static std::string DataItem(const XdmfPair& pair, const std::string& array, uint64_t rows, uint64_t columns,
                              const char* numbers) {
    return absl::StrCat("        <DataItem Dimensions=\"", rows, columns == 1 ? "" : absl::StrCat(" ", columns), "\" ",
                        numbers, " Format=\"HDF\">", XmlText(pair.heavy_name), ":/", array, "</DataItem>\n");
  }

  static std::string Attribute(const XdmfPair& pair, const std::string& name, const char* center,
                               const std::string& array, uint64_t rows, const char* numbers) {
    return absl::StrCat("      <Attribute Name=\"", XmlText(name), "\" AttributeType=\"Scalar\" Center=\"", center,
                        "\">\n", DataItem(pair, array, rows, 1, numbers), "      </Attribute>\n");
  }

  // Points, and cells of `corners` corners.
  std::string BeginGrid(const XdmfPair& pair, const char* name, const char* cells, uint64_t count, int corners) const {
    constexpr std::array kTypes = {"Polyline", "Triangle", "Tetrahedron"};
    constexpr std::array kSecondTypes = {"Edge_3", "Triangle_6", "Tetrahedron_10"};
    const int nodes = NodesOf(corners, shape_.order);
    const char* const type = (shape_.order == MeshOrder::kFirst ? kTypes : kSecondTypes)[corners - 2];
    return absl::StrCat("<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n    <Grid Name=\"", name,
                        "\" GridType=\"Uniform\">\n      <Geometry GeometryType=\"",
                        shape_.dimension == 2 ? "XY" : "XYZ", "\">\n",
                        DataItem(mesh_, "points", shape_.vertex_count, shape_.dimension, kXdmfDouble),
                        "      </Geometry>\n      <Topology TopologyType=\"", type, "\" NumberOfElements=\"", count,
                        "\" NodesPerElement=\"", nodes, "\">\n", DataItem(pair, cells, count, nodes, kXdmfInt64),
                        "      </Topology>\n");
  }

  // Names by tags and ids, as meshio has them.
  std::string EndGrid() const {
    std::string names;
    for (const BoundaryPart& part : shape_.boundary) {
      AppendName(part.name, shape_.dimension - 1, part.tag, names);
    }
    for (const Region& region : shape_.regions) {
      AppendName(region.name, shape_.dimension, region.id, names);
    }
    return absl::StrCat(
        names.empty() ? "" : absl::StrCat("      <Information><![CDATA[<main>", names, "</main>]]></Information>\n"),
        "    </Grid>\n  </Domain>\n</Xdmf>\n");
  }

  static void AppendName(const std::string& name, int dimension, int32_t number, std::string& names) {
    if (!name.empty()) {
      absl::StrAppend(&names, "<map key=\"", XmlText(name), "\" dim=\"", dimension, "\">", number, "</map>");
    }
  }

  // Names of arrays are ours: XDMF has no way to write a colon in one.
  static std::string ArrayOfAttribute(size_t index) { return absl::StrCat("attribute_", index); }

  void WriteMeshGrid() {
    std::string grid = BeginGrid(mesh_, "mesh", "simplices", shape_.simplex_count, shape_.dimension + 1);
    if (shape_.has_simplex_regions || !shape_.regions.empty()) {
      grid += Attribute(mesh_, kVtkRegion, "Cell", kVtkRegion, shape_.simplex_count, kXdmfInt32);
    }
    grid += Attribute(mesh_, "input", "Node", "input", shape_.vertex_count, kXdmfByte);
    if (shape_.has_weights) {
      grid += Attribute(mesh_, "weights", "Node", "weights", shape_.vertex_count, kXdmfDouble);
    }
    if (shape_.has_vertex_marks) {
      grid += Attribute(mesh_, kVtkOrigin, "Node", kVtkOrigin, shape_.vertex_count, kXdmfInt64);
      grid += Attribute(mesh_, kVtkBoundary, "Node", kVtkBoundary, shape_.vertex_count, kXdmfInt32);
    }
    for (size_t i = 0; i < shape_.attributes.size(); ++i) {
      grid += Attribute(mesh_, shape_.attributes[i], "Node", ArrayOfAttribute(i), shape_.vertex_count, kXdmfDouble);
    }
    mesh_.grid.Write(grid);
    mesh_.grid.Write(EndGrid());
  }

  void WriteBoundaryGrid() {
    boundary_->grid.Write(BeginGrid(*boundary_, kVtkBoundary, "facets", shape_.facet_count(), shape_.dimension));
    boundary_->grid.Write(Attribute(*boundary_, kVtkBoundary, "Cell", "facet_tags", shape_.facet_count(), kXdmfInt32));
    boundary_->grid.Write(EndGrid());
  }

  const MeshShape shape_;
  XdmfPair mesh_;
  std::optional<XdmfPair> boundary_;
  std::optional<HdfFile> file_;           // of mesh_
  std::optional<HdfFile> boundary_file_;  // of boundary_
  std::string array_;                     // of file_, the one that is being written
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplex_regions_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  uint64_t attribute_values_ = 0;
};

// The pair of files "NAME.xdmf" and "NAME.h5".
absl::StatusOr<XdmfPair> CreateXdmfPair(const std::string& grid, const std::string& heavy,
                                        const std::stop_token& stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile grid_file, OutputFile::Create(grid, stop));
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile heavy_file, OutputFile::Create(heavy, stop));
  return XdmfPair{.grid = std::move(grid_file),
                  .heavy = std::move(heavy_file),
                  .heavy_name = heavy.substr(heavy.find_last_of('/') + 1)};
}

}  // namespace

std::vector<std::string> XdmfFilesOf(const std::string& path) {
  return {path, WithExtension(path, ".h5"), WithExtension(path, "_boundary.xdmf"), WithExtension(path, "_boundary.h5")};
}

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateXdmf(const std::string& path, const MeshShape& shape,
                                                       std::stop_token stop) {
  const std::vector<std::string> names = XdmfFilesOf(path);
  WELLSPACE_ASSIGN_OR_RETURN(XdmfPair mesh, CreateXdmfPair(names[0], names[1], stop));
  std::optional<XdmfPair> boundary;
  if (!shape.boundary.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(XdmfPair pair, CreateXdmfPair(names[2], names[3], stop));
    boundary.emplace(std::move(pair));
  }
  return std::make_unique<XdmfWriter>(std::move(mesh), std::move(boundary), shape, std::move(stop));
}

}  // namespace wellspace::formats
