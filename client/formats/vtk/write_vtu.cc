// VTK's XML for unstructured grids.
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "client/formats/vtk/vtk_array.h"
#include "client/formats/vtk/vtk_cells.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class VtuWriter final : public MeshWriter {
 public:
  VtuWriter(OutputFile output, const MeshShape& shape) : shape_(shape), output_(std::move(output)) {
    output_.Write(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" "
        "compressor=\"vtkZLibDataCompressor\">\n"
        "  <UnstructuredGrid>\n");
    if (const std::string names = NameLines(shape_).Text(""); !names.empty()) {
      output_.Write("    <FieldData>\n");
      BeginArray(absl::StrCat("type=\"UInt8\" Name=\"", kVtkNames, "\" NumberOfTuples=\"", names.size(), "\""),
                 names.size());
      for (const char letter : names) {
        array_->Add<uint8_t>(static_cast<uint8_t>(letter));
      }
      EndArray();
      output_.Write("    </FieldData>\n");
    }
    AddNote(NameLines(shape_).ChangesNote());
    output_.Write(absl::StrCat("    <Piece NumberOfPoints=\"", shape_.vertex_count, "\" NumberOfCells=\"",
                               VtkCellCount(shape_), "\">\n      <Points>\n"));
    BeginArray("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", shape_.vertex_count * 3 * sizeof(double));
  }

  absl::Status AddPoints(std::span<const double> points) override {
    for (; !points.empty() && Status().ok(); points = points.subspan(shape_.dimension)) {
      for (int axis = 0; axis < 3; ++axis) {
        array_->Add<double>(axis < shape_.dimension ? points[axis] : 0.0);
      }
      ++vertices_;
    }
    return Status();
  }

  absl::Status AddWeights(std::span<const double> weights) override {
    BeginPointData();
    for (size_t i = 0; i < weights.size() && Status().ok(); ++i) {
      array_->Add<double>(weights[i]);
    }
    weights_ += weights.size();
    return Status();
  }

  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override {
    if (!std::exchange(has_origins_, true)) {
      NextOfPointData("Int64", kVtkOrigin, sizeof(int64_t));
    }
    for (size_t i = 0; i < origins.size() && Status().ok(); ++i) {
      array_->Add<int64_t>(SignedOrigin(origins[i]));
    }
    return Status();
  }

  absl::Status AddVertexTags(std::span<const int32_t> tags) override {
    if (!std::exchange(has_vertex_tags_, true)) {
      NextOfPointData("Int32", kVtkBoundary, sizeof(int32_t));
    }
    for (size_t i = 0; i < tags.size() && Status().ok(); ++i) {
      array_->Add<int32_t>(tags[i]);
    }
    return Status();
  }

  absl::Status AddAttribute(size_t index, std::span<const double> values) override {
    if (attributes_begun_ == index) {
      ++attributes_begun_;
      NextOfPointData("Float64", shape_.attributes[index].c_str(), sizeof(double));
    }
    for (size_t i = 0; i < values.size() && Status().ok(); ++i) {
      array_->Add<double>(values[i]);
    }
    attribute_values_ += values.size();
    return Status();
  }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    BeginRegions();
    for (size_t i = 0; i < regions.size() && Status().ok(); ++i) {
      array_->Add<int32_t>(regions[i]);
    }
    simplex_regions_ += regions.size();
    return Status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    BeginCells();
    for (size_t i = 0; i < facets.size() && Status().ok(); ++i) {
      array_->Add<int64_t>(facets[i]);
    }
    facets_ += facets.size() / shape_.facet_nodes();
    return Status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginCells();
    for (size_t i = 0; i < simplices.size() && Status().ok(); ++i) {
      array_->Add<int64_t>(simplices[i]);
    }
    simplices_ += simplices.size() / shape_.simplex_nodes();
    return Status();
  }

  absl::Status Commit() override {
    BeginCells();
    EndArray();
    const uint64_t cells = VtkCellCount(shape_);
    BeginArray("type=\"Int64\" Name=\"offsets\"", cells * sizeof(int64_t));
    for (uint64_t cell = 0; cell < cells; ++cell) {
      array_->Add<int64_t>(static_cast<int64_t>(VtkOffset(shape_, cell + 1)));
    }
    EndArray();
    BeginArray("type=\"UInt8\" Name=\"types\"", cells);
    for (uint64_t cell = 0; cell < cells; ++cell) {
      array_->Add<uint8_t>(VtkCellType(shape_, cell));
    }
    EndArray();
    output_.Write("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n");
    WELLSPACE_RETURN_IF_ERROR(Status());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_,
                                                     .simplex_regions = simplex_regions_,
                                                     .simplices = simplices_,
                                                     .facets = facets_,
                                                     .attribute_values = attribute_values_}));
    return output_.Commit();
  }

 private:
  const absl::Status& Status() const { return status_.ok() ? output_.status() : status_; }

  void BeginArray(const std::string& attributes, uint64_t bytes) {
    output_.Write(absl::StrCat("        <DataArray ", attributes, " format=\"binary\">\n"));
    array_.emplace(output_, bytes);
  }

  void EndArray() {
    if (absl::Status status = array_->Finish(); status_.ok()) {
      status_ = std::move(status);
    }
    output_.Write("\n        </DataArray>\n");
  }

  void BeginPointData() {
    if (std::exchange(has_point_data_, true)) {
      return;
    }
    EndArray();
    output_.Write("      </Points>\n      <PointData>\n");
    BeginArray("type=\"UInt8\" Name=\"input\"", shape_.vertex_count);
    for (uint64_t vertex = 0; vertex < shape_.vertex_count; ++vertex) {
      array_->Add<uint8_t>(vertex < shape_.input_vertices ? 1 : 0);
    }
    if (shape_.has_weights) {
      NextOfPointData("Float64", "weights", sizeof(double));
    }
  }

  void NextOfPointData(const char* type, const char* name, uint64_t value_bytes) {
    BeginPointData();
    EndArray();
    BeginArray(absl::StrCat("type=\"", type, "\" Name=\"", name, "\""), shape_.vertex_count * value_bytes);
  }

  void EndPointData() {
    BeginPointData();
    if (shape_.part != nullptr) {
      WritePartOfPoints(*shape_.part);
    }
    EndArray();
    output_.Write("      </PointData>\n");
  }

  void WritePartOfPoints(const PartNumbers& part) {
    NextOfPointData("Int64", kVtkPointIds, sizeof(int64_t));
    AddEach<int64_t>(part.vertex_ids);
    NextOfPointData("Int32", kVtkOwner, sizeof(int32_t));
    AddEach<int32_t>(part.vertex_owners);
    NextOfPointData("Int64", kVtkRow, sizeof(int64_t));
    AddEach<int64_t>(part.vertex_rows);
    NextOfPointData("UInt8", kVtkGhosts, sizeof(uint8_t));
    AddGhosts(part.own_vertices, shape_.vertex_count);
  }

  // Facets are numbered behind the simplices of the whole mesh, and are no ghosts.
  void WritePartOfCells(const PartNumbers& part) {
    BeginCellData("Int64", kVtkCellIds, sizeof(int64_t));
    AddEach<int64_t>(part.simplex_ids);
    AddEach<int64_t>(part.facet_ids, static_cast<int64_t>(part.whole_simplices));
    EndArray();
    BeginCellData("Int32", kVtkOwner, sizeof(int32_t));
    AddEach<int32_t>(part.simplex_owners);
    AddRepeated(static_cast<int32_t>(part.part), shape_.facet_count());
    EndArray();
    BeginCellData("UInt8", kVtkGhosts, sizeof(uint8_t));
    AddGhosts(part.own_simplices, shape_.simplex_count);
    AddGhosts(shape_.facet_count(), shape_.facet_count());
    EndArray();
  }

  template <typename T>
  void AddEach(std::span<const uint32_t> values, T before = 0) {
    for (size_t i = 0; i < values.size() && Status().ok(); ++i) {
      array_->Add<T>(before + static_cast<T>(values[i]));
    }
  }

  void AddGhosts(uint64_t own, uint64_t count) {
    for (uint64_t i = 0; i < count && Status().ok(); ++i) {
      array_->Add<uint8_t>(i < own ? 0 : kVtkDuplicate);
    }
  }

  void BeginCellData(const char* type, const char* name, uint64_t value_bytes) {
    BeginArray(absl::StrCat("type=\"", type, "\" Name=\"", name, "\""), VtkCellCount(shape_) * value_bytes);
  }

  void BeginRegions() {
    if (!std::exchange(has_regions_, true)) {
      EndPointData();
      output_.Write("      <CellData>\n");
      BeginCellData("Int32", kVtkRegion, sizeof(int32_t));
    }
  }

  // Region and tag of every cell. Regions of simplices have been written if there are several.
  void WriteCellData() {
    if (!HasCellData(shape_)) {
      EndPointData();
      return;
    }
    BeginRegions();
    if (!shape_.has_simplex_regions) {
      AddRepeated(shape_.regions.empty() ? 0 : shape_.regions[0].id, shape_.simplex_count);
    }
    AddRepeated(0, shape_.facet_count());
    EndArray();
    if (!shape_.boundary.empty()) {
      WriteTags();
    }
    if (shape_.part != nullptr) {
      WritePartOfCells(*shape_.part);
    }
    output_.Write("      </CellData>\n");
  }

  void WriteTags() {
    BeginCellData("Int32", kVtkBoundary, sizeof(int32_t));
    AddRepeated(0, shape_.simplex_count);
    for (const BoundaryPart& part : shape_.boundary) {
      AddRepeated(part.tag, part.facets);
    }
    EndArray();
  }

  void AddRepeated(int32_t value, uint64_t count) {
    for (; count > 0 && Status().ok(); --count) {
      array_->Add<int32_t>(value);
    }
  }

  void BeginCells() {
    if (!std::exchange(has_cells_, true)) {
      WriteCellData();
      output_.Write("      <Cells>\n");
      BeginArray("type=\"Int64\" Name=\"connectivity\"", VtkOffset(shape_, VtkCellCount(shape_)) * sizeof(int64_t));
    }
  }

  const MeshShape shape_;
  OutputFile output_;
  std::optional<VtkArrayWriter> array_;  // the one that is being written
  bool has_point_data_ = false;          // the element
  bool has_cells_ = false;               // the element
  bool has_origins_ = false;             // the array
  bool has_vertex_tags_ = false;         // the array
  bool has_regions_ = false;             // the array
  size_t attributes_begun_ = 0;          // arrays
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplex_regions_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  uint64_t attribute_values_ = 0;
  absl::Status status_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtu(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<VtuWriter>(std::move(output), shape);
}

}  // namespace wellspace::formats
