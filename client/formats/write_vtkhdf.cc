// VTK's HDF5 for unstructured grids: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html, "VTKHDF",
// version 1.0.
#include <hdf5.h>

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/file_error.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/output_file.h"
#include "client/formats/vtk_cells.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr hsize_t kRowsPerChunk = 1 << 15;
constexpr unsigned kDeflateLevel = 4;

// Libraries of HDF5 need not be thread-safe, and keep state for all files of a process. What could not be written
// because the disk was full stays in that state, and a try to write it at the end of the process would crash, so there
// is to be none: all files are closed.
std::mutex& Hdf5Mutex() {
  static std::mutex mutex;
  [[maybe_unused]] static const herr_t no_atexit = H5dont_atexit();
  return mutex;
}

// An object of HDF5, closed at the end of its life. REQUIRES: Hdf5Mutex() is held whenever one ends.
class Handle {
 public:
  Handle() = default;
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() { Close(); }

  operator hid_t() const { return id_; }
  // Whether that went well; what is buffered goes to the file now.
  bool Close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

template <typename T>
hid_t TypeOf();
template <>
hid_t TypeOf<double>() {
  return H5T_IEEE_F64LE;
}
template <>
hid_t TypeOf<int64_t>() {
  return H5T_STD_I64LE;
}
template <>
hid_t TypeOf<int32_t>() {
  return H5T_STD_I32LE;
}
template <>
hid_t TypeOf<uint8_t>() {
  return H5T_STD_U8LE;
}

// The file, in which arrays are written one after the other. Errors are kept, as an OutputFile keeps them.
//
// REQUIRES: Hdf5Mutex() is held during all calls, and at the end of its life.
class HdfFile {
 public:
  HdfFile(std::string path, std::stop_token stop) : path_(std::move(path)), stop_(std::move(stop)) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are returned, not printed
    errno = 0;
    file_ = Handle(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    Check(file_ >= 0);
    root_ = AddGroup(file_, "VTKHDF");
    AddHeader();
  }

  const absl::Status& status() const { return status_; }

  Handle AddGroup(hid_t parent, const char* name) {
    Handle group(H5Gcreate2(parent, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    Check(group >= 0);
    return group;
  }
  hid_t root() const { return root_; }

  // Ends the array before.
  template <typename T>
  void BeginArray(hid_t group, const char* name, uint64_t rows, uint64_t columns = 1) {
    EndArray();
    const hsize_t shape[] = {rows, columns};
    const int rank = columns == 1 ? 1 : 2;
    const Handle space(H5Screate_simple(rank, shape, nullptr), H5Sclose);
    const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    if (rows > 0) {
      const hsize_t chunk[] = {std::min<hsize_t>(rows, kRowsPerChunk), columns};
      Check(H5Pset_chunk(properties, rank, chunk) >= 0 && H5Pset_shuffle(properties) >= 0 &&
            H5Pset_deflate(properties, kDeflateLevel) >= 0);
    }
    array_ = Handle(H5Dcreate2(group, name, TypeOf<T>(), space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose);
    Check(array_ >= 0);
    columns_ = columns;
    row_ = 0;
  }

  // The next rows of the array.
  template <typename T>
  void Add(std::span<const T> values) {
    if (status_.ok() && stop_.stop_requested()) {
      status_ = absl::CancelledError(absl::StrCat("cancelled while writing ", path_));
    }
    if (!status_.ok() || values.empty()) {
      return;
    }
    const hsize_t start[] = {row_, 0};
    const hsize_t count[] = {values.size() / columns_, columns_};
    const int rank = columns_ == 1 ? 1 : 2;
    const Handle memory(H5Screate_simple(rank, count, nullptr), H5Sclose);
    const Handle space(H5Dget_space(array_), H5Sclose);
    errno = 0;
    Check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr) >= 0 &&
          H5Dwrite(array_, TypeOf<T>(), memory, space, H5P_DEFAULT, values.data()) >= 0);
    row_ += count[0];
  }

  // An array of `rows` values that `value_of` gives by their row.
  template <typename T, typename ValueOf>
  void AddArray(hid_t group, const char* name, uint64_t rows, ValueOf value_of) {
    BeginArray<T>(group, name, rows);
    std::vector<T> block;
    for (uint64_t begin = 0; begin < rows && status_.ok(); begin += kRowsPerChunk) {
      block.clear();
      for (uint64_t row = begin; row < std::min<uint64_t>(rows, begin + kRowsPerChunk); ++row) {
        block.push_back(value_of(row));
      }
      Add<T>(block);
    }
  }

  // Closes the file, and returns the first error of all.
  absl::Status Finish() {
    EndArray();
    root_.Close();
    errno = 0;
    Check(file_.Close());
    return status_;
  }

 private:
  void EndArray() {
    errno = 0;
    Check(array_.Close());
  }

  void AddHeader() {
    constexpr int64_t kVersion[] = {1, 0};
    constexpr hsize_t kVersionCount = 2;
    const Handle pair(H5Screate_simple(1, &kVersionCount, nullptr), H5Sclose);
    const Handle version(H5Acreate2(root_, "Version", H5T_STD_I64LE, pair, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    Check(H5Awrite(version, H5T_STD_I64LE, kVersion) >= 0);

    constexpr std::string_view kType = "UnstructuredGrid";
    const Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
    Check(H5Tset_size(text, kType.size()) >= 0 && H5Tset_strpad(text, H5T_STR_NULLPAD) >= 0);
    const Handle one(H5Screate(H5S_SCALAR), H5Sclose);
    const Handle type(H5Acreate2(root_, "Type", text, one, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    Check(H5Awrite(type, text, kType.data()) >= 0);
  }

  // Keeps an error, the system's where there was one. The calls that set errno are those that write.
  void Check(bool ok) {
    if (!ok && status_.ok()) {
      const std::string message = absl::StrCat("cannot write ", path_);
      status_ =
          errno != 0 ? WriteError(errno, message) : absl::InternalError(absl::StrCat(message, ": HDF5 says no more"));
    }
  }

  const std::string path_;
  const std::stop_token stop_;
  absl::Status status_;
  Handle file_;
  Handle root_;
  Handle array_;  // the one that is being written
  hsize_t columns_ = 1;
  hsize_t row_ = 0;
};

// Calls `use` with blocks of as many rows as a chunk, of `width` values each: what is converted takes little memory.
template <typename T, typename Use>
void ForEachBlock(std::span<const T> values, uint64_t width, Use use) {
  for (; !values.empty(); values = values.subspan(std::min<size_t>(values.size(), kRowsPerChunk * width))) {
    use(values.first(std::min<size_t>(values.size(), kRowsPerChunk * width)));
  }
}

class VtkHdfWriter final : public MeshWriter {
 public:
  VtkHdfWriter(OutputFile output, const MeshShape& shape, std::stop_token stop)
      : shape_(shape), output_(std::move(output)) {
    const std::lock_guard lock(Hdf5Mutex());
    file_.emplace(output_.temporary_path(), std::move(stop));
    const uint64_t cells = VtkCellCount(shape_);
    for (const auto& [name, count] :
         {std::pair("NumberOfPoints", shape_.vertex_count), std::pair("NumberOfCells", cells),
          std::pair("NumberOfConnectivityIds", VtkOffset(shape_, cells))}) {
      file_->AddArray<int64_t>(file_->root(), name, 1, [count = count](uint64_t) { return count; });
    }
    file_->AddArray<int64_t>(file_->root(), "Offsets", cells + 1,
                             [this](uint64_t cell) { return VtkOffset(shape_, cell); });
    file_->AddArray<uint8_t>(file_->root(), "Types", cells,
                             [this](uint64_t cell) { return VtkCellType(shape_, cell); });
    AddCellData();
    Handle point_data = file_->AddGroup(file_->root(), "PointData");
    file_->AddArray<uint8_t>(point_data, "input", shape_.vertex_count,
                             [this](uint64_t vertex) { return vertex < shape_.input_vertices ? 1 : 0; });
    file_->BeginArray<double>(file_->root(), "Points", shape_.vertex_count, 3);
  }

  ~VtkHdfWriter() override {
    const std::lock_guard lock(Hdf5Mutex());
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

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    const std::lock_guard lock(Hdf5Mutex());
    if (!std::exchange(has_regions_, true)) {
      const Handle cell_data(H5Gopen2(file_->root(), "CellData", H5P_DEFAULT), H5Gclose);
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
    simplices_ += simplices.size() / (shape_.dimension + 1);
    return AddCells(simplices);
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    facets_ += facets.size() / shape_.dimension;
    return AddCells(facets);
  }

  absl::Status Commit() override {
    {
      const std::lock_guard lock(Hdf5Mutex());
      BeginCells();
      WELLSPACE_RETURN_IF_ERROR(file_->Finish());
    }
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_,
                                                     .simplex_regions = simplex_regions_,
                                                     .simplices = simplices_,
                                                     .facets = facets_}));
    return output_.Commit();
  }

 private:
  void BeginCells() {
    if (!std::exchange(has_cells_, true)) {
      file_->BeginArray<int64_t>(file_->root(), "Connectivity", VtkOffset(shape_, VtkCellCount(shape_)));
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
    const Handle point_data(H5Gopen2(file_->root(), "PointData", H5P_DEFAULT), H5Gclose);
    file_->BeginArray<T>(point_data, name, shape_.vertex_count);
  }

  // What ends the array of regions: facets have none.
  void AddRegionsOfFacets() {
    const std::vector<int32_t> zeros(std::min<uint64_t>(shape_.facet_count(), kRowsPerChunk));
    for (uint64_t done = 0; done < shape_.facet_count(); done += kRowsPerChunk) {
      file_->Add<int32_t>(std::span(zeros).first(std::min<uint64_t>(shape_.facet_count() - done, kRowsPerChunk)));
    }
  }

  // Region and tag of every cell. Regions of simplices come later if there are several.
  void AddCellData() {
    if (shape_.boundary.empty() && !shape_.has_simplex_regions) {
      return;
    }
    const uint64_t cells = VtkCellCount(shape_);
    const Handle cell_data = file_->AddGroup(file_->root(), "CellData");
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
  bool has_weights_ = false;      // the array
  bool has_cells_ = false;        // the array
  bool has_origins_ = false;      // the array
  bool has_vertex_tags_ = false;  // the array
  bool has_regions_ = false;      // the array
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplex_regions_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtkHdf(const std::string& path, const MeshShape& shape,
                                                         std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, stop));
  return std::make_unique<VtkHdfWriter>(std::move(output), shape, std::move(stop));
}

}  // namespace wellspace::formats
