// VTK's XML for unstructured grids.
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/output_file.h"
#include "client/formats/vtk_array.h"

namespace wellspace::formats {
namespace {

constexpr uint8_t kTriangle = 5;
constexpr uint8_t kTetrahedron = 10;

class VtuWriter final : public MeshWriter {
 public:
  VtuWriter(OutputFile output, const MeshShape& shape) : shape_(shape), output_(std::move(output)) {
    output_.Write(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" "
        "compressor=\"vtkZLibDataCompressor\">\n"
        "  <UnstructuredGrid>\n");
    output_.Write(absl::StrCat("    <Piece NumberOfPoints=\"", shape_.vertex_count, "\" NumberOfCells=\"",
                               shape_.simplex_count, "\">\n      <Points>\n"));
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

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginCells();
    for (size_t i = 0; i < simplices.size() && Status().ok(); ++i) {
      array_->Add<int64_t>(simplices[i]);
    }
    simplices_ += simplices.size() / (shape_.dimension + 1);
    return Status();
  }

  absl::Status Commit() override {
    BeginCells();
    EndArray();
    const int64_t corners = shape_.dimension + 1;
    BeginArray("type=\"Int64\" Name=\"offsets\"", shape_.simplex_count * sizeof(int64_t));
    for (uint64_t simplex = 0; simplex < shape_.simplex_count; ++simplex) {
      array_->Add<int64_t>((static_cast<int64_t>(simplex) + 1) * corners);
    }
    EndArray();
    BeginArray("type=\"UInt8\" Name=\"types\"", shape_.simplex_count);
    for (uint64_t simplex = 0; simplex < shape_.simplex_count; ++simplex) {
      array_->Add<uint8_t>(shape_.dimension == 2 ? kTriangle : kTetrahedron);
    }
    EndArray();
    output_.Write("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n");
    if (absl::Status status = Status(); !status.ok()) {
      return status;
    }
    if (absl::Status status = CheckComplete(shape_, vertices_, weights_, simplices_); !status.ok()) {
      return status;
    }
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
      EndArray();
      BeginArray("type=\"Float64\" Name=\"weights\"", shape_.vertex_count * sizeof(double));
    }
  }

  void BeginCells() {
    if (!std::exchange(has_cells_, true)) {
      BeginPointData();
      EndArray();
      output_.Write("      </PointData>\n      <Cells>\n");
      BeginArray("type=\"Int64\" Name=\"connectivity\"",
                 shape_.simplex_count * (shape_.dimension + 1) * sizeof(int64_t));
    }
  }

  const MeshShape shape_;
  OutputFile output_;
  std::optional<VtkArrayWriter> array_;  // the one that is being written
  bool has_point_data_ = false;          // the element
  bool has_cells_ = false;               // the element
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplices_ = 0;
  absl::Status status_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtu(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  absl::StatusOr<OutputFile> output = OutputFile::Create(path, std::move(stop));
  if (!output.ok()) {
    return output.status();
  }
  return std::make_unique<VtuWriter>(*std::move(output), shape);
}

}  // namespace wellspace::formats
