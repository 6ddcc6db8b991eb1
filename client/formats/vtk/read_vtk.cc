// VTK's legacy format: points with their data, and meshes.
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/point_rows.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/vtk_legacy.h"
#include "client/formats/vtk/vtk_mesh.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class VtkPointsReader final : public VtkLegacyReader {
 public:
  VtkPointsReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : VtkLegacyReader(reader), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    const absl::Status status = ReadSections();
    // The rest after the points is only looked at to tell of it.
    if (!status.ok() && (WantsData() || !has_points())) {
      return status;
    }
    std::vector<std::string> names = {"x", "y", "z"};
    std::vector<std::vector<double>> columns = std::move(coordinates_);
    for (auto& [array_names, array_columns] : arrays_) {
      names.insert(names.end(), array_names.begin(), array_names.end());
      for (std::vector<double>& column : array_columns) {
        columns.push_back(std::move(column));
      }
    }
    NoteCells(cells_, cloud_);
    return AddAllRows(names, columns, options_, cloud_);
  }

 private:
  struct Array {
    std::vector<std::string> names;
    Columns columns;
  };

  bool WantsData() const { return options_.keep_attributes || !options_.columns.empty(); }
  Columns& Coordinates() override { return coordinates_; }

  Columns* Place(const Data& data) override {
    if (data.of != Data::Of::kPoints || !has_points() || data.rows != point_count() || !WantsData()) {
      is_done_ = is_done_ || (has_points() && !WantsData());
      return nullptr;
    }
    arrays_.push_back({DataNames(data.name, data.components), {}});
    return &arrays_.back().columns;
  }

  bool WantsCells(std::string_view keyword, uint64_t cells) override {
    if (keyword != "CELL_TYPES" && keyword != "VERTICES") {
      cells_ += cells;
      is_done_ = !WantsData();
    }
    return keyword == "CELL_TYPES";
  }

  // Cells that are vertices are the points once more.
  absl::Status UseCells(std::string_view, uint64_t, const std::vector<double>&,
                        const std::vector<double>& types) override {
    for (const double type : types) {
      cells_ -= cells_ > 0 && (type == kVtkVertex || type == kVtkPolyVertex) ? 1 : 0;
    }
    return absl::OkStatus();
  }

  bool IsDone() const override { return is_done_; }

  const CloudOptions& options_;
  PointCloud& cloud_;
  bool is_done_ = false;
  uint64_t cells_ = 0;
  Columns coordinates_ = Columns(3);
  std::vector<Array> arrays_;
};

class VtkMeshReader final : public VtkLegacyReader {
 public:
  VtkMeshReader(LineReader& reader, bool keeps_cell_data) : VtkLegacyReader(reader), keeps_cell_data_(keeps_cell_data) {
    grid_.file = reader.name();
  }

  absl::StatusOr<Mesh> Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadSections());
    if (dataset() != "POLYDATA" && dataset() != "UNSTRUCTURED_GRID") {
      return absl::InvalidArgumentError(
          absl::StrCat(grid_.file, ": expected cells that are simplices, got a ", dataset()));
    }
    grid_.points = point_count();
    for (uint64_t point = 0; point < grid_.points; ++point) {
      for (int axis = 0; axis < 3; ++axis) {
        const double x = coordinates_[axis][point];
        if (x - x != 0) {
          return absl::InvalidArgumentError(
              absl::StrCat(grid_.file, ": point ", point, ": expected finite coordinates, got ", x));
        }
        grid_.coordinates.push_back(x);
      }
    }
    coordinates_.clear();
    WELLSPACE_RETURN_IF_ERROR(TakeData());
    return MakeVtkMesh(std::move(grid_));
  }

 private:
  Columns& Coordinates() override { return coordinates_; }

  Columns* Place(const Data& data) override {
    Columns* place = nullptr;
    if (data.components != 1) {
      return PlaceOfCellData(data);
    }
    if (data.of == Data::Of::kPoints && data.name == "weights") {
      place = &weights_;
      grid_.has_weights = true;
    } else if (data.of == Data::Of::kCells && data.name == kVtkBoundary && data.is_whole) {
      place = &tags_;
      grid_.has_tags = true;
    } else if (data.of == Data::Of::kCells && data.name == kVtkRegion && data.is_whole) {
      place = &regions_;
      grid_.has_regions = true;
    } else if (data.of == Data::Of::kFile && data.name == kVtkNames && data.is_whole) {
      place = &names_;
    } else {
      return PlaceOfCellData(data);
    }
    if (place != nullptr) {
      *place = Columns(1);
    }
    return place;
  }

  Columns* PlaceOfCellData(const Data& data) {
    return keeps_cell_data_ && data.of == Data::Of::kCells
               ? &cell_arrays_.emplace_back(DataNames(data.name, data.components), Columns()).second
               : nullptr;
  }

  bool WantsCells(std::string_view, uint64_t) override { return true; }

  absl::Status UseCells(std::string_view keyword, uint64_t cells, const std::vector<double>& offsets,
                        const std::vector<double>& numbers) override {
    if (keyword == "CELL_TYPES") {
      for (const double type : numbers) {
        grid_.types.push_back(WholeOr(type, 0));
      }
      return absl::OkStatus();
    }
    size_t at = 0;
    for (uint64_t cell = 0; cell < cells; ++cell) {
      uint64_t size = 0;
      if (offsets.empty()) {
        size = at < numbers.size() ? static_cast<uint64_t>(WholeOr(numbers[at++], 0)) : 0;
      } else {
        const int64_t begin = WholeOr(offsets[cell], -1);
        const int64_t end = WholeOr(offsets[cell + 1], -1);
        size = begin == static_cast<int64_t>(at) && end >= begin ? end - begin : numbers.size() + 1;
      }
      if (size > numbers.size() - at || (offsets.empty() && size == 0)) {
        return reader().Error(absl::StrCat(keyword == "CELLS" ? "CELLS" : "a list of cells", ": cell ", cell,
                                           ": expected a number of vertices that are there, got more, or none"));
      }
      for (const size_t end = at + size; at < end; ++at) {
        grid_.connectivity.push_back(WholeOr(numbers[at], -1));
      }
      grid_.offsets.push_back(static_cast<int64_t>(grid_.connectivity.size()));
      if (keyword != "CELLS") {
        grid_.types.push_back(VtkPolyDataType(keyword, size));
      }
    }
    if (at != numbers.size()) {
      return reader().Error(absl::StrCat("expected vertices of ", cells, " cells, got ", numbers.size() - at, " more"));
    }
    grid_.cells += cells;
    return absl::OkStatus();
  }

  // `value` as a whole number, or `other`.
  static int64_t WholeOr(double value, int64_t other) {
    constexpr double kLimit = 9e15;
    return value >= -kLimit && value <= kLimit && value == static_cast<double>(static_cast<int64_t>(value))
               ? static_cast<int64_t>(value)
               : other;
  }

  absl::Status TakeData() {
    grid_.weights = grid_.has_weights ? std::move(weights_[0]) : std::vector<double>();
    for (const double weight : grid_.weights) {
      if (weight - weight != 0) {
        return absl::InvalidArgumentError(absl::StrCat(grid_.file, ": weights: expected finite numbers, got ", weight));
      }
    }
    for (const double tag : tags_.empty() ? std::vector<double>() : tags_[0]) {
      grid_.tags.push_back(WholeOr(tag, 0));
    }
    for (const double region : regions_.empty() ? std::vector<double>() : regions_[0]) {
      grid_.regions.push_back(WholeOr(region, 0));
    }
    for (const double letter : names_.empty() ? std::vector<double>() : names_[0]) {
      grid_.names += static_cast<char>(static_cast<uint8_t>(WholeOr(letter, 0)));
    }
    for (auto& [names, columns] : cell_arrays_) {
      for (size_t i = 0; i < names.size(); ++i) {
        grid_.cell_data.push_back({std::move(names[i]), std::move(columns[i])});
      }
    }
    return absl::OkStatus();
  }

  const bool keeps_cell_data_;
  VtkGrid grid_;
  std::deque<std::pair<std::vector<std::string>, Columns>> cell_arrays_;  // each keeps its place
  Columns coordinates_ = Columns(3);
  Columns weights_;
  Columns tags_;
  Columns regions_;
  Columns names_;
};

}  // namespace

absl::Status ReadVtkPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return VtkPointsReader(reader, options, cloud).Read();
}

absl::StatusOr<Mesh> ReadVtk(const std::string& path, const MeshNumbers& numbers) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  LineReader reader(std::move(file));
  return VtkMeshReader(reader, numbers.of_simplices).Read();
}

}  // namespace wellspace::formats
