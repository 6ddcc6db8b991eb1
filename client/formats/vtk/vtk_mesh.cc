#include "client/formats/vtk/vtk_mesh.h"

#include <algorithm>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/formats/boundary.h"
#include "client/formats/io/number.h"
#include "client/formats/names.h"
#include "client/formats/regions.h"
#include "client/formats/vtk/vtk_cells.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// How many vertices a cell has that is a simplex; 0 of others.
uint64_t CornersOfVtkCell(int64_t type) {
  switch (type) {
    case kVtkVertex:
      return 1;
    case kVtkLine:
      return 2;
    case kVtkTriangle:
      return 3;
    case kVtkTetrahedron:
      return 4;
    default:
      return 0;
  }
}

absl::string_view Text(std::string_view text) { return {text.data(), text.size()}; }

class VtkMeshMaker {
 public:
  explicit VtkMeshMaker(VtkGrid grid) : grid_(std::move(grid)) {}

  absl::StatusOr<Mesh> Make() {
    WELLSPACE_RETURN_IF_ERROR(CheckCounts());
    const auto has_cell = [this](uint8_t type) {
      return std::find(grid_.types.begin(), grid_.types.end(), type) != grid_.types.end();
    };
    const bool are_flat_points = grid_.cells == 0 && absl::StrContains(grid_.names, Text(kFlatLine));
    mesh_.dimension = are_flat_points || (!has_cell(kVtkTetrahedron) && has_cell(kVtkTriangle)) ? 2 : 3;
    WELLSPACE_RETURN_IF_ERROR(TakeCells());
    WELLSPACE_RETURN_IF_ERROR(TakePoints());
    mesh_.weights = std::move(grid_.weights);
    mesh_.numbers = std::move(grid_.numbers);
    TakeCellData();
    for (const absl::string_view line : absl::StrSplit(grid_.names, '\n')) {
      TakeNameLine({line.data(), line.size()}, &facets_, &regions_);
    }
    facets_.MoveTo(mesh_);
    regions_.MoveTo(mesh_);
    NoteSkipped();
    return std::move(mesh_);
  }

 private:
  absl::Status FileError(std::string_view message) const {
    return absl::InvalidArgumentError(
        absl::StrCat(grid_.file, ": ", absl::string_view(message.data(), message.size())));
  }

  absl::Status CheckCounts() const {
    const VtkGrid& g = grid_;
    if (g.coordinates.size() != 3 * g.points) {
      return FileError(absl::StrCat("expected ", 3 * g.points, " coordinates for ", g.points, " points, got ",
                                    g.coordinates.size()));
    }
    if (g.types.size() != g.cells || g.offsets.size() != g.cells) {
      return FileError(absl::StrCat("expected a type and an offset for each of ", g.cells, " cells, got ",
                                    g.types.size(), " types and ", g.offsets.size(), " offsets"));
    }
    if (g.has_weights && g.weights.size() != g.points) {
      return FileError(absl::StrCat("expected a weight for each of ", g.points, " points, got ", g.weights.size()));
    }
    if (!g.numbers.empty() && g.numbers.size() != g.points) {
      return FileError(absl::StrCat("point data ", Quote(g.numbers_name), ": expected a number for each of ", g.points,
                                    " points, got ", g.numbers.size()));
    }
    if (g.has_tags && g.tags.size() != g.cells) {
      return FileError(absl::StrCat("expected a tag for each of ", g.cells, " cells, got ", g.tags.size()));
    }
    if (g.has_regions && g.regions.size() != g.cells) {
      return FileError(absl::StrCat("expected a region for each of ", g.cells, " cells, got ", g.regions.size()));
    }
    for (const Attribute& data : g.cell_data) {
      if (data.values.size() != g.cells) {
        return FileError(absl::StrCat("cell data ", Quote(data.name), ": expected a number for each of ", g.cells,
                                      " cells, got ", data.values.size()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status TakeCells() {
    uint64_t needed = 0;
    for (size_t cell = 0; cell < grid_.cells; ++cell) {
      const uint64_t corners = CornersOfVtkCell(grid_.types[cell]);
      if (corners == 0) {
        return FileError(absl::StrCat("cell ", cell, ": expected only triangles (5) or only tetrahedra (10), got type ",
                                      grid_.types[cell]));
      }
      needed += corners;
    }
    if (grid_.connectivity.size() != needed) {
      return FileError(absl::StrCat("expected ", needed, " vertices for ", grid_.cells,
                                    mesh_.dimension == 2 ? " triangles" : " tetrahedra", ", got ",
                                    grid_.connectivity.size()));
    }
    uint64_t first = 0;
    for (size_t cell = 0; cell < grid_.cells; ++cell) {
      const uint64_t end = first + CornersOfVtkCell(grid_.types[cell]);
      if (grid_.offsets[cell] != static_cast<int64_t>(end)) {
        return FileError(absl::StrCat("cell ", cell, ": expected offset ", end, ", got ", grid_.offsets[cell]));
      }
      WELLSPACE_RETURN_IF_ERROR(TakeCell(cell, std::span(grid_.connectivity).subspan(first, end - first)));
      first = end;
    }
    return absl::OkStatus();
  }

  absl::Status TakeCell(size_t cell, std::span<const int64_t> corners) {
    vertices_.clear();
    for (const int64_t corner : corners) {
      if (corner < 0 || static_cast<uint64_t>(corner) >= grid_.points) {
        return FileError(
            absl::StrCat("cell ", cell, ": expected vertices from 0 to below ", grid_.points, ", got ", corner));
      }
      vertices_.push_back(static_cast<uint32_t>(corner));
    }
    const size_t dimension = mesh_.dimension;
    if (corners.size() == dimension + 1) {
      const int64_t region = grid_.has_regions ? grid_.regions[cell] : 0;
      if (region != static_cast<int32_t>(region)) {
        return FileError(absl::StrCat("cell ", cell, ": expected a region of at most 32 bits, got ", region));
      }
      regions_.Add(static_cast<int32_t>(region));
      if (!grid_.cell_data.empty()) {
        simplex_cells_.push_back(cell);
      }
      mesh_.simplices.insert(mesh_.simplices.end(), vertices_.begin(), vertices_.end());
      return absl::OkStatus();
    }
    if (corners.size() != dimension || !grid_.has_tags) {
      ++skipped_;
      return absl::OkStatus();
    }
    const int64_t tag = grid_.tags[cell];
    if (tag != static_cast<int32_t>(tag)) {
      return FileError(absl::StrCat("cell ", cell, ": expected a tag of at most 32 bits, got ", tag));
    }
    facets_.Add(vertices_, static_cast<int32_t>(tag));
    return absl::OkStatus();
  }

  absl::Status TakePoints() {
    mesh_.points.reserve(grid_.points * mesh_.dimension);
    for (size_t point = 0; point < grid_.points; ++point) {
      for (int axis = 0; axis < mesh_.dimension; ++axis) {
        mesh_.points.push_back(grid_.coordinates[3 * point + axis]);
      }
      if (mesh_.dimension == 2 && grid_.coordinates[3 * point + 2] != 0) {
        return FileError(absl::StrCat("point ", point, ": expected z = 0 in a mesh of triangles, got ",
                                      grid_.coordinates[3 * point + 2]));
      }
    }
    return absl::OkStatus();
  }

  void TakeCellData() {
    for (Attribute& data : grid_.cell_data) {
      for (size_t simplex = 0; simplex < simplex_cells_.size(); ++simplex) {
        data.values[simplex] = data.values[simplex_cells_[simplex]];  // at or behind its place
      }
      data.values.resize(simplex_cells_.size());
    }
    mesh_.simplex_attributes = std::move(grid_.cell_data);
  }

  void NoteSkipped() {
    if (skipped_ > 0) {
      mesh_.notes.push_back(absl::StrCat(grid_.file, ": ", skipped_, skipped_ == 1 ? " cell is" : " cells are",
                                         " left out: beside the ", SimplexName(mesh_.dimension), ", only their ",
                                         mesh_.dimension == 2 ? "edges" : "faces", " with a tag in the cell data \"",
                                         kVtkBoundary, "\" are read"));
    }
  }

  VtkGrid grid_;
  Mesh mesh_;
  FacetSorter facets_;
  RegionCollector regions_;
  std::vector<uint32_t> vertices_;     // of a cell
  std::vector<size_t> simplex_cells_;  // of each simplex, if cells have data
  uint64_t skipped_ = 0;               // cells
};

}  // namespace

absl::StatusOr<Mesh> MakeVtkMesh(VtkGrid grid) { return VtkMeshMaker(std::move(grid)).Make(); }

}  // namespace wellspace::formats
