// VTK's HDF5 for unstructured grids: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html, "VTKHDF",
// version 1.0.
#include <algorithm>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/boundary.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "client/formats/vtk/hdf_file.h"
#include "client/formats/vtk/vtk_cells.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class VtkHdfWriter final : public MeshWriter {
 public:
  VtkHdfWriter(OutputFile output, const MeshShape& shape, std::stop_token stop)
      : shape_(shape), output_(std::move(output)) {
    const std::lock_guard lock(Hdf5Mutex());
    file_.emplace(output_.temporary_path(), std::move(stop));
    root_ = file_->AddGroup(file_->file(), "VTKHDF");
    constexpr int64_t kVersion[] = {1, 0};
    file_->AddAttribute(root_, "Version", kVersion);
    file_->AddAttribute(root_, "Type", "UnstructuredGrid");
    const uint64_t cells = VtkCellCount(shape_);
    for (const auto& [name, count] :
         {std::pair("NumberOfPoints", shape_.vertex_count), std::pair("NumberOfCells", cells),
          std::pair("NumberOfConnectivityIds", VtkOffset(shape_, cells))}) {
      file_->AddArray<int64_t>(root_, name, 1, [count = count](uint64_t) { return count; });
    }
    file_->AddArray<int64_t>(root_, "Offsets", cells + 1, [this](uint64_t cell) { return VtkOffset(shape_, cell); });
    file_->AddArray<uint8_t>(root_, "Types", cells, [this](uint64_t cell) { return VtkCellType(shape_, cell); });
    AddCellData();
    const NameLines names(shape_);
    AddNote(names.ChangesNote());
    if (const std::string text = names.Text(""); !text.empty()) {
      const Handle field_data = file_->AddGroup(root_, "FieldData");
      file_->AddArray<uint8_t>(field_data, kVtkNames, text.size(),
                               [&text](uint64_t at) { return static_cast<uint8_t>(text[at]); });
    }
    Handle point_data = file_->AddGroup(root_, "PointData");
    file_->AddArray<uint8_t>(point_data, "input", shape_.vertex_count,
                             [this](uint64_t vertex) { return vertex < shape_.input_vertices ? 1 : 0; });
    file_->BeginArray<double>(root_, "Points", shape_.vertex_count, 3);
  }

  ~VtkHdfWriter() override {
    const std::lock_guard lock(Hdf5Mutex());
    root_.Close();
    file_.reset();
  }

  absl::Status AddPoints(std::span<const double> points) override {
    const std::lock_guard lock(Hdf5Mutex());
    std::vector<double> padded;
    ForEachBlock(points, shape_.dimension, [&](std::span<const double> block) {
      padded.clear();
      for (; !block.empty(); block = block.subspan(shape_.dimension)) {
        for (int axis = 0; axis < 3; ++axis) {
          padded.push_back(axis < shape_.dimension ? block[axis] : 0.0);
        }
      }
      file_->Add<double>(padded);
    });
    vertices_ += points.size() / shape_.dimension;
    return file_->status();
  }

  absl::Status AddWeights(std::span<const double> weights) override {
    const std::lock_guard lock(Hdf5Mutex());
    if (!std::exchange(has_weights_, true)) {
      BeginPointData<double>("weights");
    }
    file_->Add<double>(weights);
    weights_ += weights.size();
    return file_->status();
  }

  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override {
    const std::lock_guard lock(Hdf5Mutex());
    if (!std::exchange(has_origins_, true)) {
      BeginPointData<int64_t>(kVtkOrigin);
    }
    std::vector<int64_t> values;
    ForEachBlock(origins, 1, [&](std::span<const uint32_t> block) {
      values.clear();
      for (const uint32_t origin : block) {
        values.push_back(SignedOrigin(origin));
      }
      file_->Add<int64_t>(values);
    });
    return file_->status();
  }

  absl::Status AddVertexTags(std::span<const int32_t> tags) override {
    const std::lock_guard lock(Hdf5Mutex());
    if (!std::exchange(has_vertex_tags_, true)) {
      BeginPointData<int32_t>(kVtkBoundary);
    }
    file_->Add<int32_t>(tags);
    return file_->status();
  }

  absl::Status AddAttribute(size_t index, std::span<const double> values) override {
    const std::lock_guard lock(Hdf5Mutex());
    if (attributes_begun_ == index) {
      ++attributes_begun_;
      BeginPointData<double>(shape_.attributes[index].c_str());
    }
    file_->Add<double>(values);
    attribute_values_ += values.size();
    return file_->status();
  }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    const std::lock_guard lock(Hdf5Mutex());
    if (!std::exchange(has_regions_, true)) {
      const Handle cell_data(H5Gopen2(root_, "CellData", H5P_DEFAULT), H5Gclose);
      file_->BeginArray<int32_t>(cell_data, kVtkRegion, VtkCellCount(shape_));
    }
    file_->Add<int32_t>(regions);
    simplex_regions_ += regions.size();
    if (simplex_regions_ == shape_.simplex_count) {
      AddRegionsOfFacets();
    }
    return file_->status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    simplices_ += simplices.size() / shape_.simplex_nodes();
    return AddCells(simplices);
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    facets_ += facets.size() / shape_.facet_nodes();
    return AddCells(facets);
  }

  absl::Status Commit() override {
    {
      const std::lock_guard lock(Hdf5Mutex());
      BeginCells();
      root_.Close();
      WELLSPACE_RETURN_IF_ERROR(file_->Finish());
    }
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_,
                                                     .simplex_regions = simplex_regions_,
                                                     .simplices = simplices_,
                                                     .facets = facets_,
                                                     .attribute_values = attribute_values_}));
    return output_.Commit();
  }

 private:
  void BeginCells() {
    if (!std::exchange(has_cells_, true)) {
      file_->BeginArray<int64_t>(root_, "Connectivity", VtkOffset(shape_, VtkCellCount(shape_)));
    }
  }

  // Vertices of cells, rows of any width.
  absl::Status AddCells(std::span<const uint32_t> vertices) {
    const std::lock_guard lock(Hdf5Mutex());
    BeginCells();
    std::vector<int64_t> indices;
    ForEachBlock(vertices, 1, [&](std::span<const uint32_t> block) {
      indices.assign(block.begin(), block.end());
      file_->Add<int64_t>(indices);
    });
    return file_->status();
  }

  template <typename T>
  void BeginPointData(const char* name) {
    const Handle point_data(H5Gopen2(root_, "PointData", H5P_DEFAULT), H5Gclose);
    file_->BeginArray<T>(point_data, name, shape_.vertex_count);
  }

  // The end of the array of regions: facets have none.
  void AddRegionsOfFacets() {
    const std::vector<int32_t> zeros(std::min<uint64_t>(shape_.facet_count(), kRowsPerChunk));
    for (uint64_t done = 0; done < shape_.facet_count(); done += kRowsPerChunk) {
      file_->Add<int32_t>(std::span(zeros).first(std::min<uint64_t>(shape_.facet_count() - done, kRowsPerChunk)));
    }
  }

  // Region and tag of every cell. Regions of simplices come later if there are several.
  void AddCellData() {
    if (!HasCellData(shape_)) {
      return;
    }
    const uint64_t cells = VtkCellCount(shape_);
    const Handle cell_data = file_->AddGroup(root_, "CellData");
    if (!shape_.has_simplex_regions) {
      const int32_t region = shape_.regions.empty() ? 0 : shape_.regions[0].id;
      file_->AddArray<int32_t>(cell_data, kVtkRegion, cells,
                               [&](uint64_t cell) { return cell < shape_.simplex_count ? region : 0; });
    }
    if (shape_.boundary.empty()) {
      return;
    }
    PartWalk walk(shape_.boundary);
    file_->AddArray<int32_t>(cell_data, kVtkBoundary, cells,
                             [&](uint64_t cell) { return cell < shape_.simplex_count ? 0 : walk.Next().tag; });
  }

  const MeshShape shape_;
  OutputFile output_;  // gives the file its name; HDF5 writes it
  std::optional<HdfFile> file_;
  Handle root_;                   // the group of all arrays
  bool has_weights_ = false;      // the array
  bool has_cells_ = false;        // the array
  bool has_origins_ = false;      // the array
  bool has_vertex_tags_ = false;  // the array
  bool has_regions_ = false;      // the array
  size_t attributes_begun_ = 0;   // arrays
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplex_regions_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  uint64_t attribute_values_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtkHdf(const std::string& path, const MeshShape& shape,
                                                         std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, stop));
  return std::make_unique<VtkHdfWriter>(std::move(output), shape, std::move(stop));
}

}  // namespace wellspace::formats
